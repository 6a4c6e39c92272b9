// What pages written in TypeScript do with the viewer: `tsc` accepts it, and refuses the lines after @ts-expect-error.
import { PbmViewer } from "../viewer/pbm-viewer.js";

const viewer = document.createElement("pbm-viewer");
const same: PbmViewer = viewer;
viewer.addEventListener("progress", ({ detail }) => console.log(detail.totalProgress * 100));
viewer.addEventListener("error", (event) => console.log(event.detail.name, event.detail.offset ?? 0));
viewer.addEventListener("click", () => viewer.resetCamera());
viewer.addEventListener("keydown", (event) => event.shiftKey && event.key.toUpperCase());
viewer.interactionPrompt = "auto";
viewer.setCamera({ orbit: "30deg auto 105%", target: viewer.getCameraTarget(), fieldOfView: 30 }, { smooth: false });
const { theta } = same.getCameraOrbit();
viewer.toBlob({ mimeType: "image/jpeg", qualityArgument: theta }).then((blob) => blob && viewer.open(blob));
viewer.statistics().then((statistics) => statistics?.fastTime.toFixed());
viewer.positionFromPoint(1, 2).then((point) => point && String(point));
Object.assign(viewer, { src: "lion.pbvg", alt: null });
viewer.cameraOrbit = "30deg auto 105%";
viewer.maxMemory = 512;
viewer.autoRotate = viewer.quality !== "fast";
viewer.backs = "hide";
viewer.lightFollows = null;
viewer.headlight = "-60deg 20deg";
viewer.dropClass = "noise";
viewer.colourBy = viewer.noLegend ? "height,0,1,grey" : null;
// @ts-expect-error
viewer.quality = "best";
// @ts-expect-error
viewer.backs = "none";
// @ts-expect-error
viewer.setCamera({ orbit: 7 });
// @ts-expect-error
viewer.loaded = true;
