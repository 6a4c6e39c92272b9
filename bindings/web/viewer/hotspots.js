// Children of the viewer that stay at a point of the model: <button slot="hotspot-NAME" data-position="x y z">.
import { parsePoint, project } from "./orbit.js";

export class Hotspots {
    #host;
    #layer;
    #all = []; // {element, box, position, normal}

    // `layer`: an element of the same size as the host, in its shadow tree.
    constructor(host, layer) {
        this.#host = host;
        this.#layer = layer;
    }

    // Points and normals (or null) in model units, in the order of the children.
    get places() {
        return this.#all.map(({ position, normal }) => ({ position, normal }));
    }

    // Takes the children that the host has now. `metre`: model units.
    find(metre) {
        this.#layer.replaceChildren();
        this.#all = [];
        for (const element of this.#host.querySelectorAll(':scope > [slot^="hotspot"]')) {
            const box = Object.assign(document.createElement("div"), { className: "hotspot away" });
            box.append(Object.assign(document.createElement("slot"), { name: element.slot }));
            const { position = "", normal } = element.dataset;
            try {
                this.#all.push({
                    element,
                    box,
                    position: parsePoint(position, metre),
                    normal: normal ? parsePoint(normal, metre) : null,
                });
                this.#layer.append(box);
            } catch (error) {
                console.error(`pbm-viewer: ${element.slot}: ${error.message}`);
            }
        }
    }

    // Moves the children to where a picture with this camera shows their points. `visible`: for each, whether the
    // picture does not hide it.
    show(camera, visible) {
        const { clientWidth: width, clientHeight: height } = this.#host;
        for (const [i, { element, box, position }] of this.#all.entries()) {
            const { x, y, depth } = project(position, camera, width, height);
            const inside = depth > 0 && x >= 0 && y >= 0 && x <= width && y <= height;
            box.classList.toggle("away", !inside);
            if (inside) box.style.transform = `translate(${x}px, ${y}px) translate(-50%, -50%)`;
            const isVisible = visible[i] ?? false;
            box.classList.toggle("hidden", !isVisible);
            box.inert = !isVisible; // nobody comes to what is hidden by keys
            mark(element, isVisible);
        }
    }

    // There is no picture.
    hide() {
        for (const { element, box } of this.#all) {
            box.classList.add("away");
            mark(element, false);
        }
    }
}

function mark(element, isVisible) {
    if (element.hasAttribute("data-visible") === isVisible) return;
    element.toggleAttribute("data-visible", isVisible);
    element.dispatchEvent(new CustomEvent("hotspot-visibility", { detail: { visible: isVisible } }));
}
