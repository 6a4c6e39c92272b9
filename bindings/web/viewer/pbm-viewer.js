// <pbm-viewer src="scan.pbvg" controls></pbm-viewer>: shows a binary voxel grid (.pbvg) on a page.
// pbm-viewer.d.ts describes attributes, events and methods.
import { CODES } from "../module/errors.js";
import { fileName } from "./addresses.js";
import { FIRST_BYTES } from "./answers.js";
import { showCredits } from "./credit.js";
import { listen } from "./gestures.js";
import { Hotspots } from "./hotspots.js";
import { exposureOf, lookOf } from "./look.js";
import { Motion } from "./motion.js";
import { cameraOf, describe, orbitFrom, orbitOf, stageOf } from "./orbit.js";
import { Paper } from "./paper.js";
import { Place } from "./place.js";
import { adoptProperties, defineProperties, isOn, wordOf } from "./properties.js";
import { build } from "./template.js";
import { TEXTS, languageOf, noticeOf, textOf } from "./texts.js";
import { WorkerLink } from "./worker_link.js";

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
const RESTART_DELAY = 500; // ms before a worker that did not come is asked for once more
const CODE_PART = 0.4; // of its bytes that a server sends: it compresses them
const WANTED = 600 * 1024; // bytes that a picture needs, as long as nobody knows: coarse levels do not tell of finer ones

// Where there is no window, as on a server that renders pages, the module has an element that nobody can make.
const Base = globalThis.HTMLElement ?? class {};

class PbmViewer extends Base {
    static observedAttributes = (
        "src poster quality backs auto-rotate camera-orbit camera-target field-of-view background exposure shading light-follows headlight colour-by drop-class show-class no-legend loading reveal controls alt interaction-prompt"
    ).split(" ");

    #parts = {}; // by id
    #life = null; // AbortController of what observes the page; null: in no page
    #gestures = null; // the same, of pointers and keys
    #near = false; // to the visible part of the page
    #opened = null; // Blob that open() was given
    #url = null; // that is shown
    #link = null; // WorkerLink
    #isHeard = false; // the worker has said something
    #restarts = 0; // of the worker, for the same model
    #canvas = null;
    #context = null; // of the canvas, where workers cannot draw
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
    #wanted = null; // bytes that the picture still lacks, as far as is known; null: nothing is
    #fileBytes = null; // null: not known
    #progress = 0;
    #loaded = false;
    #dismissed = false;
    // What the element says: the notice of the network goes when the network is back, that of the view when a view has
    // no error.
    #notices = { ...NO_NOTICES };
    #hotspots;
    #place;
    #paper;

    constructor() {
        super();
        this.#parts = build(this.attachShadow({ mode: "open" }));
        this.#hotspots = new Hotspots(this, this.#parts.hotspots);
        this.#place = new Place(this.#parts.corners);
        this.#paper = new Paper(this.#parts.paper, (size) => this.#ask("paper", size));
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
        this.#listenToButtons(signal);
        document.addEventListener("visibilitychange", () => this.#pause(), { signal });
        document.addEventListener(
            "securitypolicyviolation",
            ({ blockedURI, effectiveDirective }) => {
                if (/worker|script/.test(effectiveDirective) && /^blob|view_worker/.test(blockedURI))
                    this.#failByPolicy(effectiveDirective);
            },
            { signal },
        );
        this.addEventListener("dragover", (event) => isOn(this, "controls") && event.preventDefault(), { signal });
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
        if (name === "src" || (name === "loading" && !this.#link)) this.#load();
        else if (name === "loading") this.#pause();
        else if (name === "poster" || name === "reveal") this.#showPoster();
        else if (name === "controls" || name === "alt" || name === "interaction-prompt") this.#listen();
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
        this.#restarts = 0;
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
        const point = await this.#ask("point", this.#place.partsOf(clientX, clientY));
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
        this.#restarts = 0;
        this.#showPoster();
        this.#near ||= isNearNow(this);
        if (this.#near || wordOf(this, "loading") === "eager") this.#start();
    }

    #start() {
        const src = this.getAttribute("src");
        if (!this.#life || !(this.#opened || src)) return;
        this.#close();
        this.#parts.back.hidden = !(this.#opened && src);
        try {
            this.#url = this.#opened ? null : new Request(src).url;
        } catch {
            this.#fail(fault(CODES.USAGE, "address", "noAddress", { name: fileName(src) }), true);
            return;
        }
        try {
            this.#startWorker();
        } catch (error) {
            // A frame without an origin, a policy that lacks ours: whatever the browser says, there is no worker.
            console.error(`pbm-viewer: ${error.message}`);
            this.#fail(fault(CODES.IO, "worker", "worker"), true);
            return;
        }
        this.#pause();
        this.#refresh();
    }

    #startWorker() {
        this.#canvas = document.createElement("canvas");
        this.#canvas.setAttribute("part", "canvas");
        this.#parts.input.before(this.#canvas);
        const canvas = canDrawInWorkers() ? this.#canvas.transferControlToOffscreen() : null;
        if (!canvas) this.#context = this.#canvas.getContext("2d");
        const model = { url: this.#url, blob: this.#opened, maxMemory: this.#maxMemory() };
        this.#isHeard = false;
        this.#link = new WorkerLink(
            { canvas, ...model },
            {
                message: (type, message) => this.#receive(type, message),
                failed: () => this.#onWorkerError(),
                codeArrived: () => this.#report({ bytes: this.#bytes, wanted: this.#wanted }),
            },
        );
    }

    // The worker has not come, or has broken down.
    #onWorkerError() {
        const restart = this.#isHeard ? 1 : this.#restarts;
        const { signal } = this.#life;
        const link = this.#link;
        setTimeout(() => {
            if (signal.aborted || this.#link !== link) return;
            this.#restarts += 1;
            if (restart === 0) this.#start();
            else this.#fail(fault(CODES.IO, "worker", "worker"), true);
        }, RESTART_DELAY * (1 - Math.min(restart, 1)));
    }

    #failByPolicy(directive) {
        if (!this.#link || this.#isHeard) return;
        this.#fail(fault(CODES.IO, "policy", "forbidden", { name: "view_worker.js", directive }), true);
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
        this.#link?.close();
        this.#canvas?.remove();
        this.#link = this.#canvas = this.#context = this.#info = this.#stage = this.#motion = null;
        this.#loaded = false;
        this.#bytes = this.#progress = 0;
        this.#wanted = this.#fileBytes = null;
        this.#paper.discard();
        this.#notify(NO_NOTICES);
        this.#parts.credit.replaceChildren();
        this.#parts.about.hidden = true;
        this.#parts.prompt.classList.add("gone");
        this.#hotspots.hide();
        this.#parts.bar.classList.add("gone");
        clearTimeout(this.#rotationTimer);
    }

    #receive(type, message) {
        this.#isHeard = true;
        if (type === "opened") this.#open(message);
        else if (type === "framed") {
            this.#motion.reframe(orbitOf(message.camera, this.#stage), message.aspect);
            this.#refresh();
        } else if (type === "frame") this.#showFrame(message);
        else if (type === "rest") this.#paper.prepare(this.#size);
        else if (type === "progress") this.#report(message);
        else if (type === "failed") this.#fail(message.error, message.fatal, message.passing);
        else if (type === "recovered") this.#notify({ view: "" });
        else if (type === "waiting") this.#wait(message);
    }

    #ask(question, parameters = {}) {
        return this.#link?.ask(question, parameters) ?? Promise.resolve(null);
    }

    #emit(name, detail) {
        this.dispatchEvent(new CustomEvent(name, { detail }));
    }

    #open({ info, camera, aspect }) {
        this.#info = info;
        this.#stage = stageOf(info);
        this.#motion = new Motion(this.#stage, orbitOf(camera, this.#stage), aspect, isMotionReduced);
        showCredits(this.#parts.credit, info.metadata);
        this.#parts.about.hidden = this.#parts.credit.childElementCount === 0;
        this.#parts.about.setAttribute("aria-expanded", "false");
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
            this.#parts.prompt.classList.toggle("gone", wordOf(this, "interaction-prompt") !== "auto");
            this.#emit("load", { url: this.#url });
        }
        if (complete) this.#report({ bytes: this.#bytes, wanted: 0 });
    }

    #report({ bytes, wanted, size = this.#fileBytes }) {
        const before = [this.#bytes, this.#progress];
        this.#bytes = bytes;
        this.#fileBytes = size;
        this.#wanted = wanted;
        const part = wanted === 0 && this.#loaded ? 1 : Math.min(this.#partHere(), 0.99);
        this.#progress = Math.max(this.#progress, part);
        const { bar } = this.#parts;
        bar.style.transform = `scaleX(${this.#progress})`;
        bar.classList.toggle("gone", this.#progress === 1);
        if (before[0] === bytes && before[1] === this.#progress) return;
        this.#emit("progress", { bytes, totalProgress: this.#progress });
    }

    // 0..1: the part that is here of all that the picture needs, as far as that is known: model and code.
    #partHere() {
        const code = CODE_PART * CODE_BYTES;
        const codeHere = this.#loaded ? code : Math.min(CODE_PART * (this.#link?.codeBytes ?? 0), code);
        const expected = Math.min(WANTED, this.#fileBytes ?? Infinity) - this.#bytes;
        const wanted = Math.max(this.#wanted ?? FIRST_BYTES, expected, 0);
        return (codeHere + this.#bytes) / (code + this.#bytes + wanted);
    }

    #fail(error, fatal, passing = false) {
        const text = noticeOf(languageOf(this), error, fatal);
        this.#notify({ [passing ? "view" : "model"]: text });
        if (fatal) {
            this.#parts.bar.classList.add("gone");
            this.#link?.close(); // whoever waits for an answer gets none
        }
        const { code, message, offset, name, rule } = error;
        this.#emit("error", { code, message, offset, name, rule });
    }

    #notify(changed) {
        Object.assign(this.#notices, changed);
        const { network, model, view } = this.#notices;
        this.#parts.message.textContent = this.#parts.message.title = network || model || view;
    }

    #wait({ error, times }) {
        this.#notify({ network: error ? noticeOf(languageOf(this), error, true) : "" });
        if (times === FAILURES_TOLD) {
            const { code, message, offset, name, rule } = error;
            this.#emit("error", { code, message, offset, name, rule });
        }
    }

    #appear(near) {
        const comes = near && !this.#near;
        this.#near = near;
        if (comes && !this.#link) this.#start();
        else this.#pause();
    }

    // Nothing is drawn where nobody looks.
    #pause() {
        const paused = document.hidden || (!this.#near && wordOf(this, "loading") !== "eager");
        this.#link?.post({ type: "pause", paused });
        if (!paused) this.#animate();
    }

    #drop(event) {
        const file = event.dataTransfer?.files[0];
        if (!file || !isOn(this, "controls")) return;
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
        poster.classList.toggle("gone", this.#loaded && (this.#dismissed || wordOf(this, "reveal") !== "manual"));
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

    #listenToButtons(signal) {
        const { about, back, dismiss, fullscreen, ground } = this.#parts;
        const onClick = (button, action) => button.addEventListener("click", action, { signal });
        onClick(dismiss, () => this.#notify(NO_NOTICES));
        onClick(about, () => about.setAttribute("aria-expanded", String(about.getAttribute("aria-expanded") !== "true")));
        onClick(back, () => {
            this.#opened = null;
            this.#load();
        });
        fullscreen.hidden = !document.fullscreenEnabled;
        onClick(fullscreen, () =>
            document.fullscreenElement === this ? document.exitFullscreen() : this.requestFullscreen(),
        );
        // Without this, what is seen through the picture would be black.
        this.addEventListener(
            "fullscreenchange",
            () => {
                ground.style.backgroundColor = document.fullscreenElement === this ? backgroundBehind(this) : "";
            },
            { signal },
        );
    }

    #listen() {
        const { input, about, back, dismiss, fullscreen, prompt } = this.#parts;
        const controlled = isOn(this, "controls");
        const language = languageOf(this);
        const label = this.getAttribute("alt") || textOf(language, "label");
        input.classList.toggle("controlled", controlled);
        input.setAttribute("role", controlled ? "application" : "img");
        if (controlled) input.setAttribute("aria-roledescription", textOf(language, "role"));
        else input.removeAttribute("aria-roledescription");
        input.tabIndex = controlled ? 0 : -1;
        input.setAttribute("aria-label", controlled ? textOf(language, "keys", { label }) : label);
        about.setAttribute("aria-label", textOf(language, "about"));
        dismiss.setAttribute("aria-label", textOf(language, "close"));
        fullscreen.setAttribute("aria-label", textOf(language, "fullscreen"));
        back.textContent = textOf(language, "back");
        prompt.textContent = textOf(language, matchMedia("(pointer: coarse)").matches ? "promptFinger" : "prompt");
        this.#gestures?.abort();
        if (!controlled) return;
        this.#gestures = new AbortController();
        listen(input, this.#place, this.#actions(), this.#gestures.signal);
    }

    // What input does to the view: see gestures.js.
    #actions() {
        const steer =
            (name) =>
            (...change) => {
                if (!this.#motion) return;
                this.#motion[name](...change);
                this.#touch();
            };
        return {
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
            takesWheel: (factor) => !isOn(this, "disable-zoom") && (this.#motion?.canZoom(factor) ?? false),
            begun: () => this.#parts.prompt.classList.add("gone"),
        };
    }

    // The point of the model at client coordinates x, y (null: in the middle), which zooming comes near to; null as long as
    // it is not known. A zoom keeps its point as long as it goes on at the same place.
    #pointOfZoom(x, y) {
        const place = x === null ? this.#place.middle() : { x, y };
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
        if (this.#frameRequest || !this.#link) return;
        this.#frameRequest = requestAnimationFrame((now) => {
            this.#frameRequest = 0;
            const passed = now - this.#lastTick;
            this.#lastTick = now;
            if (this.#tick(Math.min(passed, LONGEST_TICK))) this.#animate();
        });
    }

    // `passed`: ms since the last tick. Returns whether the view still moves.
    #tick(passed) {
        if (!this.#link) return false;
        if (this.#motion && this.#isRotating()) this.#motion.rotate(ROTATION_SPEED * passed);
        const moving = this.#motion?.step(passed) ?? false;
        if (moving || this.#stale) this.#post(moving);
        if (moving) this.#emit("camera-change", { source: this.#byUser ? "user-interaction" : "none" });
        else if (this.#byUser && this.#motion) {
            const language = languageOf(this);
            const place = describe(this.#motion.goal, TEXTS[language].places);
            this.#parts.spoken.textContent = textOf(language, "view", { place });
        }
        return moving;
    }

    // Whether the model turns by itself now. If it is to do so later, animation goes on then.
    #isRotating() {
        clearTimeout(this.#rotationTimer);
        if (!isOn(this, "auto-rotate") || isMotionReduced()) return false;
        const delay = this.#touched + ROTATION_DELAY - performance.now();
        if (delay > 0) this.#rotationTimer = setTimeout(() => this.#animate(), delay);
        return delay <= 0 && !document.hidden && this.#near;
    }

    #post(moving) {
        const { width, height } = this.#size;
        if (width === 0 || height === 0) return;
        this.#stale = false;
        this.#paper.discard();
        const { orbit, framed } = this.#motion ?? {};
        this.#link.post({
            type: "view",
            camera: orbit === framed ? null : cameraOf(orbit, this.#stage),
            width,
            height,
            moving,
            background: colour(this.getAttribute("background") ?? "transparent"),
            exposure: exposureOf(this),
            quality: wordOf(this, "quality"),
            backs: wordOf(this, "backs"),
            look: lookOf(this),
            hotspots: this.#hotspots.places,
        });
    }

    #findHotspots() {
        this.#hotspots.find(this.#stage?.metre ?? 1);
        this.#refresh();
    }
}

// An error as messages of the worker carry it; `key` and `values`: of a text.
function fault(code, name, key, values = {}) {
    return { code, name, offset: null, rule: "", message: textOf("en", key, values), key, values };
}

// The colour that is seen through an element: the nearest one that is not transparent.
function backgroundBehind(element) {
    for (let at = element; at; at = at.parentElement ?? at.getRootNode().host) {
        const { backgroundColor } = getComputedStyle(at);
        if (colour(backgroundColor)[3] > 0) return backgroundColor;
    }
    return "Canvas";
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
globalThis.customElements?.define("pbm-viewer", PbmViewer);
export { PbmViewer };
