// The worker of <pbm-viewer>: it owns the module, the bytes, the model and the picture, so that the page never waits.
//
// Messages to the worker                                    and from it
//   start {canvas, url | blob, maxMemory, threads}            opened {info, camera, aspect}   the model is open
//   code {files | error}  the renderer, or why not            enough {}  no more of the first answer is needed
//   answer, part, end  of the first answer: see answers.js
//   view {camera, width, height, moving, background,          framed {camera, aspect}  default camera of a new size
//         exposure, quality, backs, look, hotspots}                   frame {camera, width, height, complete, visible,
//   pause {paused}                                                   pixels}
//   ask {id, question, ...}                                   progress {bytes, wanted, size}
//                                                             failed {error, fatal, passing}  passing: the next view
//                                                                  may have no such error
//                                                             recovered {}  no passing error holds any more
//                                                             waiting {error, times}
//                                                             answer {id, value}
//                                                             rest {}  the picture is the last one of this view
//
// It draws only what changed. A moving view is drawn at the scale that keeps the frame rate; a view at rest exactly,
// and again as bytes arrive; then the fine picture with one sample and with all, between which messages are heard.
import { CODES, loadPbm } from "../module/pbm.js";
import { ForwardedAnswer } from "./answers.js";
import { ByteStore } from "./byte_store.js";
import { SourceError, openBlob, openUrl } from "./byte_sources.js";
import { exposed } from "./exposure.js";
import { joined } from "./ranges.js";
import { isVisible, stageOf, unproject } from "./orbit.js";

const REST_AFTER = 100; // ms without a change of the view
const FRAME_TIME = 22; // ms that a moving picture may take
const LEAST_SCALE = 0.25;
const REFINE_EVERY = 60; // ms between pictures that only new bytes change
const SAMPLES = 8; // of a fine picture: the default of pbm-render
const QUICK_ENOUGH = 1500; // ms that a fine picture may take with quality "auto": input waits for it
const MAX_ERROR = { fast: 2, fine: 1.42 }; // pixels: largest edge of a drawn voxel; the defaults of pbm-render
const COARSER = 1.25; // times as large, if the chunks that a picture needs take more than their part of the memory
const COARSEST = 50; // times as large
const CLEAR = [0, 0, 0, 0];
// Parts of maxMemory: decoded chunks, compressed bytes. The rest is for pictures and code.
const DECODED_PART = 0.6;
const BYTES_PART = 0.25;

class ViewWorker {
    #pbm = null;
    #model = null;
    #info = null;
    #stage = null;
    #store;
    #source;
    #maxMemory;
    #canvas;
    #context = null;
    #image = null; // ImageData of the last size
    #view = null;
    #paused = false;
    #timer = null;
    #timerAt = Infinity;
    #restAt = 0; // the view counts as moving until then
    #restTold = false;
    #changed = false; // the view changed since the last picture
    #arrived = false; // bytes arrived since the last picture
    // The last one: {camera, width, height, depths, complete, settled, scale, samples}. Settled: it is complete, or
    // what it lacks is damaged or not in the file.
    #picture = null;
    #framed = null; // default camera: {width, height, camera}
    #isMeasured = false; // whether times.fine is that of a picture for which nothing was decoded
    #readBytes = 0; // of the file, that the module took for the last picture
    #scale = 1; // of moving pictures
    #coarser = 1; // times as large as MAX_ERROR drawn voxels may be
    // ms of the last picture of each kind (fine: of each sample); when the last picture was drawn. A picture that was
    // decoded, too, counts for drawing alone (fine, fast) only until there is a better measurement.
    #times = { fast: 0, fine: 0, moving: 0, drawn: 0 };
    #started = performance.now();
    #firstAfter = null;
    #exactAfter = null;
    #told = new Set(); // errors that were reported
    #toldOfView = new Set(); // the same, of those that another view may not have
    #over = false;

    async start({ canvas, url, blob, maxMemory, threads }) {
        this.#canvas = canvas;
        this.#context = canvas?.getContext("2d") ?? null;
        this.#maxMemory = maxMemory;
        this.#store = new ByteStore(maxMemory * BYTES_PART);
        const listener = {
            arrived: () => this.#onArrival(),
            failed: (error) => this.#reportError(error, this.#model === null),
            waiting: (error, times) => post({ type: "waiting", error: error && plain(error), times }),
        };
        const options = { first: firstAnswer.response, violation: () => violated.get(url) ?? null };
        this.#source = blob ? openBlob(blob, this.#store, listener) : openUrl(url, this.#store, listener, options);
        try {
            this.#pbm = await loadPbm({ threads, files: await code });
        } catch (error) {
            this.#end(error.key ? error : new SourceError("module", "code", { reason: error.message }));
            return;
        }
        this.#schedule(0);
    }

    view(view) {
        if (view.moving) {
            this.#restAt = performance.now() + REST_AFTER;
            this.#coarser = Math.max(this.#coarser / COARSER, 1);
        }
        this.#view = view;
        this.#changed = true;
        this.#restTold = false;
        this.#schedule(0);
    }

    pause({ paused }) {
        this.#paused = paused;
        if (!paused) this.#schedule(0);
    }

    async ask({ id, question, ...parameters }) {
        let value = null;
        try {
            if (question === "point") value = this.#pointAt(parameters);
            else if (question === "statistics") value = this.#statistics();
            else if (question === "snapshot") value = await this.#snapshot(parameters);
            else if (question === "paper") value = await this.#paper(parameters);
        } catch (error) {
            this.#onError(error);
        }
        post({ type: "answer", id, value });
    }

    // Calls drawNext() after `delay` ms, or earlier if that was scheduled.
    #schedule(delay) {
        const at = performance.now() + delay;
        if (this.#over || at >= this.#timerAt) return;
        clearTimeout(this.#timer);
        this.#timerAt = at;
        this.#timer = setTimeout(() => {
            this.#timerAt = Infinity;
            this.#drawNext();
        }, delay);
    }

    #onArrival() {
        this.#arrived = true;
        const pause = Math.max(REFINE_EVERY, this.#times.drawn ? this.#times.fast : 0);
        this.#schedule(Math.max(0, this.#times.drawn + pause - performance.now()));
        if (this.#picture === null) this.#progress();
    }

    // Draws the next picture, if one is due.
    #drawNext() {
        if (this.#paused || this.#over || !this.#pbm || !this.#view) return;
        try {
            if (!this.#open()) {
                const isOver = this.#requestLacking() === 0 && !this.#stage && this.#isCut();
                if (isOver) this.#end(this.#cutError());
                return;
            }
            const now = performance.now();
            if (now < this.#restAt) {
                if (this.#changed) this.#drawMoving();
                this.#schedule(this.#restAt - performance.now() + 1);
            } else if (!this.#isExact()) {
                this.#draw(1, 0);
                this.#schedule(0);
            } else if (this.#arrived && !this.#picture.settled) {
                this.#draw(1, Math.min(this.#picture.samples, 1));
                this.#schedule(0);
            } else if (this.#isFineDue()) {
                this.#draw(1, this.#nextSamples());
                this.#schedule(0);
            } else if (this.#picture.settled && !this.#restTold) {
                this.#restTold = true;
                post({ type: "rest" });
            }
        } catch (error) {
            this.#onError(error);
        }
    }

    // Whether the model is open.
    #open() {
        if (this.#stage) return true;
        this.#arrived = false;
        if (!this.#model) {
            const size = this.#size();
            if (size === null) return false;
            const read = (offset, count) => {
                this.#readBytes += count;
                return this.#store.read(offset, count);
            };
            this.#model = this.#pbm.open({ size, read });
            // Of a file that is cut short too early the reader says what is wrong.
            if (!this.#model && this.#store.lacksBehind(this.#source.size ?? Infinity))
                this.#model = this.#pbm.open({ size: this.#source.size, read });
            if (!this.#model) return false;
        }
        this.#info ??= this.#model.info();
        const camera = this.#info && this.#defaultCamera();
        if (!camera) return false;
        this.#stage = stageOf(this.#info);
        // The page answers with the view that its attributes ask for.
        const { width, height } = this.#view;
        this.#view = null;
        post({ type: "opened", info: this.#info, camera, aspect: width / height });
        return false;
    }

    // The size that the header states (BVG.md 2.7), so that the first bytes of a file that is cut short can be shown;
    // that of the source, if it is larger or there is no header. Null: not known yet.
    #size() {
        const known = this.#source.size;
        if (this.#store.missing(0, 24).length > 0) return known;
        const header = this.#store.read(0, 24);
        if (String.fromCharCode(...header.subarray(1, 4)) !== "BVG") return known ?? this.#store.held;
        const stated = Number(new DataView(header.buffer, header.byteOffset).getBigUint64(16, true));
        return Number.isSafeInteger(stated) ? Math.max(stated, known ?? 0) : known;
    }

    // Null while its bytes are missing.
    #defaultCamera() {
        const { width, height } = this.#view;
        if (this.#framed?.width !== width || this.#framed.height !== height) {
            const camera = this.#model.defaultCamera(width, height);
            if (!camera) return null;
            this.#framed = { width, height, camera };
            if (this.#stage) post({ type: "framed", camera, aspect: width / height });
        }
        return this.#framed.camera;
    }

    // Whether the picture is that of the view, at full resolution.
    #isExact() {
        return !this.#changed && this.#picture?.scale === 1;
    }

    #isFineDue() {
        const { quality } = this.#view;
        return (
            this.#picture.settled &&
            this.#picture.samples < SAMPLES &&
            (quality === "fine" || (quality === "auto" && this.#times.fine * 2 < QUICK_ENOUGH))
        );
    }

    // One, and then all: together the others take less time than the first one, as a rule. One once more where the time
    // that it took says nothing yet.
    #nextSamples() {
        return this.#isMeasured && this.#picture.samples > 0 ? SAMPLES : 1;
    }

    // `time`: ms that a sample of the last picture took. Only a picture for which nothing was decoded tells what drawing
    // takes; of others the time is an upper bound, which decides nothing.
    #measureFine(time) {
        this.#isMeasured = this.#readBytes === 0;
        this.#times.fine = this.#isMeasured ? time : 0;
    }

    #drawMoving() {
        const { moving, fast } = this.#times;
        if (moving === 0) this.#scale = Math.sqrt(FRAME_TIME / Math.max(fast, FRAME_TIME));
        else if (moving > FRAME_TIME * 1.3 || moving < FRAME_TIME * 0.7)
            this.#scale *= Math.min(Math.max(Math.sqrt(FRAME_TIME / moving), 0.7), 1.15);
        this.#scale = Math.min(Math.max(this.#scale, LEAST_SCALE), 1);
        this.#times.moving = this.#draw(this.#scale, 0);
    }

    // `samples` above 0: a fine picture. Returns the milliseconds that it took.
    #draw(scale, samples) {
        const begin = performance.now();
        this.#readBytes = 0;
        const full = this.#view;
        const width = Math.max(1, Math.round(full.width * scale));
        const height = Math.max(1, Math.round(full.height * scale));
        this.#changed = this.#arrived = false;
        const framed = this.#defaultCamera();
        if (!framed) {
            this.#requestLacking();
            return 0;
        }
        const camera = { ...(full.camera ?? framed), backs: full.backs };
        const quality = samples > 0 ? "fine" : "fast";
        const { pixels, depths, complete, error } = this.#model.render({
            camera,
            width,
            height,
            quality,
            ...(samples > 0 && { samples }),
            background: full.exposure ? CLEAR : full.background,
            ...full.look,
            depths: true,
            maxError: MAX_ERROR[quality] * this.#coarser,
            maxMemory: Math.ceil(this.#maxMemory * DECODED_PART),
        });
        if (error?.code === CODES.LIMIT && this.#coarser < COARSEST) {
            this.#store.takeLacking();
            this.#coarser *= COARSER;
            return this.#draw(scale, samples);
        }
        this.#picture = { camera, width, height, depths, complete, scale, samples };
        const shown = this.#show(finished(pixels, full), width, height);
        const end = performance.now();
        this.#times.drawn = end;
        if (samples > 0) this.#measureFine((end - begin) / samples);
        else if (scale === 1) this.#times.fast = end - begin;
        this.#firstAfter ??= end - this.#started;
        if (complete && scale === 1) {
            this.#exactAfter ??= end - this.#started;
            if (this.#toldOfView.size > 0) post({ type: "recovered" });
            this.#toldOfView.clear();
        }
        if (error?.code === CODES.LIMIT) this.#reportOfView(this.#memoryError());
        else if (error) this.#reportError(error);
        this.#picture.settled = this.#requestLacking() === 0;
        const visible = full.hotspots.map(({ position, normal }) =>
            isVisible(position, normal, this.#picture, 3 * this.#info.voxelSize + 0.002 * this.#stage.size),
        );
        post({ type: "frame", camera, complete, visible, ...shown }, shown.pixels ? [shown.pixels] : []);
        return end - begin;
    }

    // Shows pixels on the canvas. Without one the page shows them, and the result holds a copy.
    #show(pixels, width, height) {
        if (!this.#context) return { width, height, pixels: pixels.slice().buffer };
        if (this.#canvas.width !== width) this.#canvas.width = width;
        if (this.#canvas.height !== height) this.#canvas.height = height;
        if (this.#image?.width !== width || this.#image.height !== height) this.#image = new ImageData(width, height);
        // ImageData cannot lie in the memory of the module, which threads share.
        this.#image.data.set(pixels);
        this.#context.putImageData(this.#image, 0, 0);
        return { width, height };
    }

    // Requests what the module asked for and did not get. Returns the number of ranges that are still to come.
    #requestLacking() {
        const end = this.#source.size ?? Infinity;
        if (this.#stage && this.#isCut()) this.#reportError(this.#cutError());
        const lacking = this.#store
            .takeLacking()
            .filter(([from]) => from < end)
            .map(([from, to]) => [from, Math.min(to, end)]);
        this.#store.trim();
        this.#source.want(lacking);
        this.#progress(lacking);
        return lacking.length;
    }

    // Whether the file ends before its header says so.
    #isCut() {
        return this.#source.size !== null && this.#source.size < (this.#size() ?? 0);
    }

    #cutError() {
        return new SourceError("header.size", "cut", { have: this.#source.size, size: this.#size() }, CODES.INVALID);
    }

    #progress(lacking = null) {
        const wanted = lacking ? joined(lacking, 0).reduce((sum, [from, to]) => sum + to - from, 0) : null;
        post({ type: "progress", bytes: this.#source.figures.bytes, wanted, size: this.#source.size });
    }

    // The point of the model in the picture, at parts 0..1 of its width and height, or null.
    #pointAt({ x, y }) {
        if (!this.#picture) return null;
        const { camera, width, height, depths } = this.#picture;
        const column = Math.min(Math.floor(x * width), width - 1);
        const row = Math.min(Math.floor(y * height), height - 1);
        const depth = depths[row * width + column];
        if (!Number.isFinite(depth)) return null;
        return unproject(column + 0.5, row + 0.5, depth, camera, width, height);
    }

    // The picture that is shown, at full resolution, as a Blob. Without a canvas the page makes it of what it shows.
    async #snapshot({ mimeType, quality }) {
        if (!this.#stage || !this.#view) return null;
        if (!this.#isExact()) this.#draw(1, 0);
        return this.#context ? this.#canvas.convertToBlob({ type: mimeType, quality }) : null;
    }

    // A picture for paper, of what is in memory, as an ImageBitmap. Null if there is no room for it, or no view that rests.
    async #paper({ width, height }) {
        if (!this.#stage || !this.#isExact()) return null;
        const picture = this.#picture;
        picture.depths = picture.depths.slice(); // the module draws the next picture in the same place
        const { camera, backs, background, exposure, look } = this.#view;
        const context = new OffscreenCanvas(width, height).getContext("2d");
        try {
            const { pixels } = this.#model.render({
                camera: { ...(camera ?? this.#model.defaultCamera(width, height)), backs },
                width,
                height,
                quality: picture.samples > 0 ? "fine" : "fast",
                ...(picture.samples > 0 && { samples: 1 }),
                background: exposure ? CLEAR : background,
                ...look,
                maxError: MAX_ERROR.fine * this.#coarser,
                maxMemory: Math.ceil(this.#maxMemory * DECODED_PART),
            });
            context.putImageData(new ImageData(finished(pixels, this.#view).slice(), width), 0, 0);
        } catch {
            return null;
        }
        this.#store.takeLacking();
        return context.canvas.transferToImageBitmap();
    }

    #statistics() {
        const { bytes, requests } = this.#source.figures;
        const { fast, fine, moving } = this.#times;
        const { width = 0, height = 0, complete = false, samples = 0, scale = 1 } = this.#picture ?? {};
        return {
            version: this.#pbm?.version ?? null,
            threads: this.#pbm?.threads ?? 0,
            bytes,
            requests,
            heldBytes: this.#store.held,
            width,
            height,
            complete,
            samples,
            scale,
            resting:
                performance.now() >= this.#restAt && this.#isExact() && this.#picture.settled && !this.#isFineDue(),
            fastTime: fast,
            fineTime: fine,
            movingTime: moving,
            firstPictureAfter: this.#firstAfter,
            exactPictureAfter: this.#exactAfter,
        };
    }

    #memoryError() {
        return new SourceError("limit.memory", "memory", { megabytes: this.#maxMemory / 1e6 }, CODES.LIMIT);
    }

    #reportError(error, fatal = false) {
        this.#tell(this.#told, error, { fatal, passing: false });
    }

    #reportOfView(error) {
        this.#tell(this.#toldOfView, error, { fatal: false, passing: true });
    }

    #tell(told, error, kind) {
        const key = `${error.name} ${error.offset}`;
        if (told.has(key)) return;
        told.add(key);
        post({ type: "failed", error: plain(error), ...kind });
    }

    // A picture may be too large, or its camera see nothing: the next view may be better.
    #onError(error) {
        if (this.#stage && (error.code === CODES.USAGE || error.code === CODES.LIMIT)) this.#reportOfView(error);
        else this.#end(error);
    }

    // Nothing can be drawn any more.
    #end(error) {
        this.#over = true;
        this.#source.close();
        // The reader's words of a file that is cut short are for those who examine files.
        this.#reportError(error.name === "header.size" && this.#isCut() ? this.#cutError() : error, true);
    }
}

// The pixels as the view asks for them.
function finished(pixels, { exposure, background }) {
    return exposure ? exposed(pixels, exposure, background) : pixels;
}

// What messages carry of an error. One without a code is a fault of the viewer itself.
function plain({ code = CODES.LIMIT, message, offset = null, name, rule = "", key, values }) {
    // Messages of the module begin with the rule.
    const text = rule && message.startsWith(`${rule} `) ? message.slice(rule.length + 1) : message;
    return { code, message: text, offset, name, rule, key, values };
}

const post = (message, transfer = []) => self.postMessage(message, transfer);

// Addresses that a Content-Security-Policy forbade, with its directive.
const violated = new Map();
self.addEventListener("securitypolicyviolation", ({ blockedURI, effectiveDirective }) =>
    violated.set(blockedURI, effectiveDirective),
);

const firstAnswer = new ForwardedAnswer(() => post({ type: "enough" }));
let takeCode;
const code = new Promise((resolve, reject) => {
    takeCode = ({ files, error }) =>
        error ? reject(new SourceError(error.name, error.key, error.values)) : resolve(files);
});
code.catch(() => {}); // start() reports it
const worker = new ViewWorker();
self.onmessage = ({ data: { type, ...message } }) => {
    if (type === "code") takeCode(message);
    else if (type in firstAnswer) firstAnswer[type](message);
    else worker[type](message);
};
