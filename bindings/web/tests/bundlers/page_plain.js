// A page without a framework.
import "pbm-viewer";

const viewer = Object.assign(document.createElement("pbm-viewer"), { id: "viewer", quality: "fast", background: "#333" });
viewer.addEventListener("load", () => document.body.setAttribute("data-heard", "load"));
document.getElementById("root").append(viewer);
viewer.src = "./model.pbvg";
