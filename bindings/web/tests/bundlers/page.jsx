// A page in React: the viewer as JSX, with a property, an attribute and an event.
import { createRoot } from "react-dom/client";
import "pbm-viewer";

function Page() {
    return (
        <pbm-viewer id="viewer" src="./model.pbvg" quality="fast" background="#333" maxMemory={300} touch-action="none"
            onload={() => document.body.setAttribute("data-heard", "load")} />
    );
}
createRoot(document.getElementById("root")).render(<Page />);
