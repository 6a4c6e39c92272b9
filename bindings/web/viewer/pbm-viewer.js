// <pbm-viewer src="scan.pbvg" controls></pbm-viewer>: shows a binary voxel grid (.pbvg) on a page.
// pbm-viewer.d.ts describes attributes, events and methods.
import { CODES } from "../module/errors.js";
import { showCredits } from "./credit.js";
import { listen } from "./gestures.js";
import { Hotspots } from "./hotspots.js";
import { lookOf, wordOf } from "./look.js";
import { Motion } from "./motion.js";
import { cameraOf, describe, orbitFrom, orbitOf, stageOf } from "./orbit.js";
import { adoptProperties, defineProperties } from "./properties.js";
import { styles, template } from "./template.js";

const DEFAULT_MEMORY = 256; // MB
const LARGEST_MEMORY = 2048; // MB: that of the module
const LARGEST_EDGE = 32768; // pixels of a picture
const NEAR_SCREEN = 200; // pixels: lazy models are loaded when they are this near to the visible part of the page
const NO_NOTICES = { network: "", model: "", view: "" };
const ROTATION_DELAY = 3000; // ms without input
const ROTATION_SPEED = Math.PI / 32 / 1000; // radians per ms
const LONGEST_TICK = 50; // ms that a view glides or turns on at once
const ZOOM_PAUSE = 400; // ms without zooming after which another zoom begins
const ZOOM_DISTANCE = 12; // CSS pixels, the same
const FAILURES_TOLD = 3; // in a row, before a network failure is an error event
const BACKS = ["auto", "show", "hide"];

class PbmViewer extends HTMLElement {
    static observedAttributes = (
        "src poster quality backs auto-rotate camera-orbit camera-target field-of-view background shading light-follows headlight colour-by drop-class show-class no-legend loading reveal controls alt"
    ).split(" ");

    #parts = {}; // by id
    #life = null; // AbortController of what observes the page; null: in no page
    #gestures = null; // the same, of pointers and keys
    #near = false; // to the visible part of the page
    #opened = null; // Blob that open() was given
    #url = null; // that is shown
    #worker = null;
    #canvas = null;
    #context = null; // of the canvas, where workers cannot draw
    #answers = new Map(); // id -> resolve
    #asked = 0;
    #info = null;
    #stage = null;
    #motion = null;
    #size = { width: 0, height: 0 }; // of the picture, device pixels
    #stale = true; // the worker does not know the view
    #frameRequest = 0;
    #rotationTimer = 0;
    #lastTick = 0;
    #touched = -Infinity; // time of the last input
    #zoom = { x: 0, y: 0, time: -Infinity, point: null }; // the last one: client coordinates, and what is there
    #byUser = false; // the last change of the view
    #bytes = 0;
    #progress = 0;
    #loaded = false;
    #dismissed = false;
    // What the element says: the notice of the network goes when the network is back, that of the view when a view has
    // no error.
    #notices = { ...NO_NOTICES };
    #hotspots;

    constructor() {
        super();
        const root = this.attachShadow({ mode: "open" });
        root.adoptedStyleSheets = [styles];
        root.append(template.content.cloneNode(true));
        for (const element of root.querySelectorAll("[id]")) this.#parts[element.id] = element;
        this.#hotspots = new Hotspots(this, this.#parts.hotspots);
    }

    connectedCallback() {
        if (this.#life) return;
        adoptProperties(this);
        this.#life = new AbortController();
        const { signal } = this.#life;
        const sizes = new ResizeObserver((entries) => this.#resize(entries.at(-1)));
        try {
            sizes.observe(this, { box: "device-pixel-content-box" });
        } catch {
            sizes.observe(this);
        }
        const nearness = new IntersectionObserver((entries) => this.#appear(entries.at(-1).isIntersecting), {
            rootMargin: `${NEAR_SCREEN}px`,
        });
        nearness.observe(this);
        const children = new MutationObserver(() => this.#findHotspots());
        children.observe(this, { childList: true });
        const places = new MutationObserver(() => this.#findHotspots());
        places.observe(this, { subtree: true, attributeFilter: ["slot", "data-position", "data-normal"] });
        const { fullscreen, dismiss } = this.#parts;
        dismiss.addEventListener("click", () => this.#notify(NO_NOTICES), { signal });
        fullscreen.hidden = !document.fullscreenEnabled;
        fullscreen.addEventListener(
            "click",
            () => (document.fullscreenElement === this ? document.exitFullscreen() : this.requestFullscreen()),
            { signal },
        );
        document.addEventListener("visibilitychange", () => this.#pause(), { signal });
        this.addEventListener("dragover", (event) => this.hasAttribute("controls") && event.preventDefault(), {
            signal,
        });
        this.addEventListener("drop", (event) => this.#drop(event), { signal });
        signal.addEventListener("abort", () => {
            for (const observer of [sizes, nearness, children, places]) observer.disconnect();
            this.#gestures?.abort();
            this.#close();
        });
        this.#listen();
        this.#findHotspots();
        this.#load();
    }

    disconnectedCallback() {
        // An element that moves to another place of the page is connected again before this runs.
        queueMicrotask(() => {
            if (this.isConnected) return;
            this.#life?.abort();
            this.#life = null;
        });
    }

    attributeChangedCallback(name, old, value) {
        if (!this.#life || old === value) return;
        if (name === "src") this.#opened = null;
        if (name === "src" || (name === "loading" && !this.#worker)) this.#load();
        else if (name === "loading") this.#pause();
        else if (name === "poster" || name === "reveal") this.#showPoster();
        else if (name === "controls" || name === "alt") this.#listen();
        else if (name.startsWith("camera-") || name === "field-of-view") this.resetCamera();
        else this.#refresh();
    }

    get loaded() {
        return this.#loaded;
    }

    get info() {
        return this.#info;
    }

    open(blob) {
        this.#opened = blob;
        this.#start();
    }

    getCameraOrbit() {
        const { theta, phi, radius } = this.#orbit();
        return { theta, phi, radius, toString: () => `${theta}rad ${phi}rad ${radius}` };
    }

    getCameraTarget() {
        const [x, y, z] = this.#orbit().target;
        return { x, y, z, toString: () => `${x} ${y} ${z}` };
    }

    getFieldOfView() {
        return (this.#orbit().viewAngle * 180) / Math.PI;
    }

    setCamera(
        { orbit = this.getCameraOrbit(), target = this.getCameraTarget(), fieldOfView = this.getFieldOfView() },
        { smooth = true } = {},
    ) {
        const angle = typeof fieldOfView === "number" ? `${fieldOfView}deg` : fieldOfView;
        this.#byUser = false;
        this.#go(this.#orbitFrom(String(orbit), String(target), angle), smooth);
    }

    resetCamera({ smooth = true } = {}) {
        if (!this.#motion) return;
        const given = ["camera-orbit", "camera-target", "field-of-view"].map((name) => this.getAttribute(name));
        this.#byUser = false;
        try {
            this.#go(this.#orbitFrom(...given), smooth);
        } catch (error) {
            console.error(`pbm-viewer: ${error.message}`);
        }
    }

    dismissPoster() {
        this.#dismissed = true;
        this.#showPoster();
    }

    async positionFromPoint(clientX, clientY) {
        const box = this.getBoundingClientRect();
        const point = await this.#ask("point", {
            x: (clientX - box.left) / box.width,
            y: (clientY - box.top) / box.height,
        });
        return point && { x: point[0], y: point[1], z: point[2], toString: () => point.join(" ") };
    }

    async toBlob({ mimeType = "image/png", qualityArgument } = {}) {
        this.#tick(0); // the worker may not have heard of the last change
        const blob = await this.#ask("snapshot", { mimeType, quality: qualityArgument });
        if (blob || !this.#context) return blob;
        return new Promise((resolve) => this.#canvas.toBlob(resolve, mimeType, qualityArgument));
    }

    statistics() {
        return this.#ask("statistics");
    }

    // Shows what `src` names, once it is due.
    #load() {
        this.#close();
        this.#dismissed = false;
        this.#showPoster();
        this.#near ||= isNearNow(this);
        if (this.#near || this.getAttribute("loading") === "eager") this.#start();
    }

    #start() {
        const src = this.getAttribute("src");
        if (!this.#life || !(this.#opened || src)) return;
        this.#close();
        try {
            this.#url = this.#opened ? null : new Request(src).url;
        } catch {
            this.#fail(fault(CODES.USAGE, "address", `"${src}" is no address of a model.`), true);
            return;
        }
        this.#canvas = document.createElement("canvas");
        this.#canvas.setAttribute("part", "canvas");
        this.#parts.input.before(this.#canvas);
        const canvas = canDrawInWorkers() ? this.#canvas.transferControlToOffscreen() : null;
        if (!canvas) this.#context = this.#canvas.getContext("2d");
        this.#worker = newWorker();
        this.#worker.onmessage = ({ data }) => this.#receive(data);
        const text = "The worker of the viewer cannot run: are all files of the package on the server?";
        this.#worker.onerror = () => this.#fail(fault(CODES.IO, "worker", text), true);
        this.#worker.postMessage(
            { type: "start", canvas, url: this.#url, blob: this.#opened, maxMemory: this.#maxMemory() },
            canvas ? [canvas] : [],
        );
        this.#pause();
        this.#refresh();
    }

    // Bytes.
    #maxMemory() {
        const text = this.getAttribute("max-memory") ?? String(DEFAULT_MEMORY);
        const megabytes = parseFloat(text);
        if (megabytes > 0) return Math.min(megabytes, LARGEST_MEMORY) * 1e6;
        console.error(`pbm-viewer: max-memory="${text}" is no number of MB above 0: it is ${DEFAULT_MEMORY} now`);
        return DEFAULT_MEMORY * 1e6;
    }

    #close() {
        if (this.#worker) this.#worker.onmessage = this.#worker.onerror = null;
        this.#worker?.terminate();
        this.#canvas?.remove();
        for (const resolve of this.#answers.values()) resolve(null);
        this.#answers.clear();
        this.#worker = this.#canvas = this.#context = this.#info = this.#stage = this.#motion = null;
        this.#loaded = false;
        this.#bytes = this.#progress = 0;
        this.#notify(NO_NOTICES);
        this.#parts.credit.replaceChildren();
        this.#hotspots.hide();
        this.#parts.bar.classList.add("gone");
        clearTimeout(this.#rotationTimer);
    }

    #receive({ type, ...message }) {
        if (type === "opened") this.#open(message);
        else if (type === "framed") {
            this.#motion.reframe(orbitOf(message.camera, this.#stage), message.aspect);
            this.#refresh();
        } else if (type === "frame") this.#showFrame(message);
        else if (type === "progress") this.#report(message);
        else if (type === "failed") this.#fail(message.error, message.fatal, message.passing);
        else if (type === "recovered") this.#notify({ view: "" });
        else if (type === "waiting") this.#wait(message);
        else {
            this.#answers.get(message.id)?.(message.value);
            this.#answers.delete(message.id);
        }
    }

    #ask(question, parameters = {}) {
        if (!this.#worker) return Promise.resolve(null);
        const id = ++this.#asked;
        this.#worker.postMessage({ type: "ask", id, question, ...parameters });
        return new Promise((resolve) => this.#answers.set(id, resolve));
    }

    #emit(name, detail) {
        this.dispatchEvent(new CustomEvent(name, { detail }));
    }

    #open({ info, camera, aspect }) {
        this.#info = info;
        this.#stage = stageOf(info);
        this.#motion = new Motion(this.#stage, orbitOf(camera, this.#stage), aspect, isMotionReduced);
        showCredits(this.#parts.credit, info.metadata);
        this.#touched = performance.now();
        this.#findHotspots();
        this.resetCamera({ smooth: false });
        this.#motion.step(0);
        this.#post(false);
    }

    #showFrame({ camera, width, height, complete, visible, pixels }) {
        if (pixels && this.#context) {
            Object.assign(this.#canvas, { width, height });
            this.#context.putImageData(new ImageData(new Uint8ClampedArray(pixels), width, height), 0, 0);
        }
        this.#hotspots.show(camera, visible);
        if (!this.#loaded) {
            this.#loaded = true;
            this.#showPoster();
            this.#emit("load", { url: this.#url });
        }
        if (complete) this.#report({ bytes: this.#bytes, wanted: 0 });
    }

    // `wanted`: bytes that the picture still lacks; null: not known.
    #report({ bytes, wanted }) {
        const before = [this.#bytes, this.#progress];
        this.#bytes = bytes;
        const part = wanted === 0 && this.#loaded ? 1 : wanted ? Math.min(bytes / (bytes + wanted), 0.99) : 0;
        this.#progress = Math.max(this.#progress, part);
        const { bar } = this.#parts;
        bar.style.transform = `scaleX(${this.#progress})`;
        bar.classList.toggle("gone", this.#progress === 1);
        if (before[0] === bytes && before[1] === this.#progress) return;
        this.#emit("progress", { bytes, totalProgress: this.#progress });
    }

    #fail(error, fatal, passing = false) {
        const place = error.offset === null ? "" : ` (byte ${error.offset})`;
        const text = fatal ? error.message : `Not all of this model can be shown: ${error.message}${place}`;
        this.#notify({ [passing ? "view" : "model"]: text });
        if (fatal) this.#parts.bar.classList.add("gone");
        this.#emit("error", error);
    }

    #notify(changed) {
        Object.assign(this.#notices, changed);
        const { network, model, view } = this.#notices;
        this.#parts.message.textContent = network || model || view;
    }

    #wait({ error, times }) {
        this.#notify({ network: error ? error.message : "" });
        if (times === FAILURES_TOLD) this.#emit("error", error);
    }

    #appear(near) {
        const comes = near && !this.#near;
        this.#near = near;
        if (comes && !this.#worker) this.#start();
        else this.#pause();
    }

    // Nothing is drawn where nobody looks.
    #pause() {
        const paused = document.hidden || (!this.#near && this.getAttribute("loading") !== "eager");
        this.#worker?.postMessage({ type: "pause", paused });
        if (!paused) this.#animate();
    }

    #drop(event) {
        const file = event.dataTransfer?.files[0];
        if (!file || !this.hasAttribute("controls")) return;
        event.preventDefault();
        this.open(file);
    }

    #showPoster() {
        const { poster } = this.#parts;
        const src = this.getAttribute("poster");
        const slot = poster.firstElementChild;
        if (slot.firstElementChild?.getAttribute("src") !== src) {
            slot.replaceChildren();
            if (src) slot.append(Object.assign(document.createElement("img"), { src, alt: "" }));
        }
        poster.classList.toggle("gone", this.#loaded && (this.#dismissed || this.getAttribute("reveal") !== "manual"));
    }

    #resize({ contentRect, devicePixelContentBoxSize: [exact] = [] }) {
        const pixels = (length, device) => {
            const estimate = length * window.devicePixelRatio;
            // Emulated screens of developer tools state CSS pixels as device pixels.
            return device && Math.abs(device - estimate) <= 1 ? device : Math.round(estimate);
        };
        const width = pixels(contentRect.width, exact?.inlineSize);
        const height = pixels(contentRect.height, exact?.blockSize);
        const scale = Math.min(1, LARGEST_EDGE / Math.max(width, height));
        const scaled = (edge) => Math.min(Math.ceil(edge * scale), LARGEST_EDGE);
        this.#size = { width: scaled(width), height: scaled(height) };
        this.#refresh();
    }

    #listen() {
        const { input } = this.#parts;
        const controlled = this.hasAttribute("controls");
        const label = this.getAttribute("alt") || "3D scan";
        input.setAttribute("role", controlled ? "application" : "img");
        if (controlled) input.setAttribute("aria-roledescription", "3D model");
        else input.removeAttribute("aria-roledescription");
        input.tabIndex = controlled ? 0 : -1;
        input.setAttribute(
            "aria-label",
            controlled ? `${label}. Arrow keys turn the view, plus and minus zoom.` : label,
        );
        this.#gestures?.abort();
        if (!controlled) return;
        this.#gestures = new AbortController();
        const steer =
            (name) =>
            (...change) => {
                if (!this.#motion) return;
                this.#motion[name](...change);
                this.#touch();
            };
        listen(
            input,
            {
                turn: steer("turn"),
                pan: steer("pan"),
                zoom: (factor, x, y, smooth) => {
                    if (!this.#motion) return;
                    this.#motion.zoom(factor, smooth, this.#pointOfZoom(x, y));
                    this.#touch();
                },
                focus: async (x, y) => {
                    const point = await this.positionFromPoint(x, y);
                    if (!point || !this.#motion) return;
                    this.#motion.go({ ...this.#motion.goal, target: [point.x, point.y, point.z] }, true);
                    this.#touch();
                },
                reset: () => {
                    this.resetCamera();
                    this.#touch();
                },
            },
            () => !this.hasAttribute("disable-zoom"),
            this.#gestures.signal,
        );
    }

    // The point of the model at client coordinates x, y (null: in the middle), which zooming comes near to; null as long as
    // it is not known. A zoom keeps its point as long as it goes on at the same place.
    #pointOfZoom(x, y) {
        const box = this.getBoundingClientRect();
        const place = { x: x ?? box.left + box.width / 2, y: y ?? box.top + box.height / 2 };
        const now = performance.now();
        const last = this.#zoom;
        if (now - last.time > ZOOM_PAUSE || Math.hypot(place.x - last.x, place.y - last.y) > ZOOM_DISTANCE) {
            const zoom = (this.#zoom = { ...place, point: null });
            this.positionFromPoint(place.x, place.y).then((found) => {
                zoom.point = found && [found.x, found.y, found.z];
            });
        }
        this.#zoom.time = now;
        return this.#zoom.point;
    }

    #touch() {
        this.#touched = performance.now();
        this.#byUser = true;
        this.#animate();
    }

    #orbit() {
        if (!this.#motion) throw new Error("There is no model yet: wait for the event load.");
        return this.#motion.goal;
    }

    #orbitFrom(...given) {
        const { framed, aspect } = this.#motion;
        return orbitFrom(framed, this.#stage, aspect, ...given);
    }

    #go(orbit, smooth) {
        this.#motion.go(orbit, smooth);
        this.#animate();
    }

    // Sends the view to the worker again, although it did not move.
    #refresh() {
        this.#stale = true;
        this.#animate();
    }

    #animate() {
        if (this.#frameRequest || !this.#worker) return;
        this.#frameRequest = requestAnimationFrame((now) => {
            this.#frameRequest = 0;
            const passed = now - this.#lastTick;
            this.#lastTick = now;
            if (this.#tick(Math.min(passed, LONGEST_TICK))) this.#animate();
        });
    }

    // `passed`: ms since the last tick. Returns whether the view still moves.
    #tick(passed) {
        if (!this.#worker) return false;
        if (this.#motion && this.#isRotating()) this.#motion.rotate(ROTATION_SPEED * passed);
        const moving = this.#motion?.step(passed) ?? false;
        if (moving || this.#stale) this.#post(moving);
        if (moving) this.#emit("camera-change", { source: this.#byUser ? "user-interaction" : "none" });
        else if (this.#byUser && this.#motion)
            this.#parts.spoken.textContent = `View from the ${describe(this.#motion.goal)}`;
        return moving;
    }

    // Whether the model turns by itself now. If it is to do so later, animation goes on then.
    #isRotating() {
        clearTimeout(this.#rotationTimer);
        if (!this.hasAttribute("auto-rotate") || isMotionReduced()) return false;
        const delay = this.#touched + ROTATION_DELAY - performance.now();
        if (delay > 0) this.#rotationTimer = setTimeout(() => this.#animate(), delay);
        return delay <= 0 && !document.hidden && this.#near;
    }

    #post(moving) {
        const { width, height } = this.#size;
        if (width === 0 || height === 0) return;
        this.#stale = false;
        const { orbit, framed } = this.#motion ?? {};
        this.#worker.postMessage({
            type: "view",
            camera: orbit === framed ? null : cameraOf(orbit, this.#stage),
            width,
            height,
            moving,
            background: colour(this.getAttribute("background") ?? "transparent"),
            quality: this.getAttribute("quality") ?? "auto",
            backs: wordOf(this.getAttribute("backs"), BACKS),
            look: lookOf(this),
            hotspots: this.#hotspots.places,
        });
    }

    #findHotspots() {
        this.#hotspots.find(this.#stage?.metre ?? 1);
        this.#refresh();
    }
}

function fault(code, name, message) {
    return { code, name, offset: null, rule: "", message };
}

function isMotionReduced() {
    return matchMedia("(prefers-reduced-motion: reduce)").matches;
}

// Whether a worker can draw a picture on a canvas of the page.
function canDrawInWorkers() {
    return (
        "transferControlToOffscreen" in HTMLCanvasElement.prototype &&
        typeof OffscreenCanvas === "function" &&
        new OffscreenCanvas(1, 1).getContext("2d") !== null
    );
}

// Whether the element is certainly near the visible part of the page. The observer knows it of every element, but only
// once the browser has drawn: a tenth of a second or more after the page has been read.
function isNearNow(element) {
    if (window !== window.top) return false;
    const { left, right, top, bottom, width, height } = element.getBoundingClientRect();
    return (
        width * height > 0 &&
        right > -NEAR_SCREEN &&
        bottom > -NEAR_SCREEN &&
        left < innerWidth + NEAR_SCREEN &&
        top < innerHeight + NEAR_SCREEN
    );
}

function newWorker() {
    if (new URL(import.meta.url).origin === location.origin)
        return new Worker(new URL("./view_worker.js", import.meta.url), { type: "module" });
    // A worker's own file must come from the origin of the page; what it imports need not.
    const code = `import ${JSON.stringify(new URL("./view_worker.js", import.meta.url).href)};`;
    return new Worker(URL.createObjectURL(new Blob([code], { type: "text/javascript" })), { type: "module" });
}

// A CSS colour, "transparent" if there is no such, as red, green, blue, alpha: 0..255.
const colours = new Map();
function colour(css) {
    if (!colours.has(css)) {
        const context = Object.assign(document.createElement("canvas"), { width: 1, height: 1 }).getContext("2d");
        context.fillStyle = "transparent";
        context.fillStyle = css;
        context.fillRect(0, 0, 1, 1);
        colours.set(css, [...context.getImageData(0, 0, 1, 1).data]);
    }
    return colours.get(css);
}

defineProperties(PbmViewer.prototype);
customElements.define("pbm-viewer", PbmViewer);
export { PbmViewer };
