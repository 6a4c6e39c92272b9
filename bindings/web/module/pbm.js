// PBM for JavaScript: opens, draws and validates binary voxel grids (.pbvg) in web pages, workers and node. pbm.d.ts
// documents it.
import createPbm from "pbm_wasm.js"; // what the linker made beside pbm.wasm; make_web_package.sh says where it is
import { CODES, PbmError, usage } from "./errors.js";
import { platform, threadsOf } from "./platform.js";
import { CAMERA, ERROR, FINDING, INFO, Memory, OPTIONS, PICTURE, VALIDATION } from "./structures.js";

export { CODES, PbmError };

/** Bits of Info.attributes. */
export const ATTRIBUTES = Object.freeze({
    COLOURS: 1,
    MATERIALS: 2,
    TEXTURE: 4,
    SHADOWS: 8,
    GROUND: 16,
    PANORAMA: 32,
    CLOSED: 64,
    ROUND_POINTS: 128,
    SIDES: 256,
    OFFSETS: 512,
});

const LATER = 7,
    FAILED = 1; // what the callback returns
const USE_BACKGROUND = 1,
    USE_HEADLIGHT = 128,
    GRADIENT = 512;
const LEAVE_OUT = { texture: 2, colours: 4, shadows: 8, ground: 16, panorama: 32, reflections: 64, legend: 256 };
const CLIP_PLANE = 1,
    CLIP_BOX = 2;
const BACKS = { auto: 0, show: 1, hide: 2 };
const QUALITIES = { fast: 0, fine: 1 };
const DEPTH_CUES = { auto: 0, "eye-dome": 1, "ambient-occlusion": 2, none: 3 };
const SHADINGS = { auto: 0, lit: 1, unlit: 2 };
const LIGHT_FOLLOWS = { default: 0, eye: 1, model: 2 };
const COLOUR_MAPS = { auto: 0, viridis: 1, grey: 2, classes: 3 };
const LEVELS = { full: 0, quick: 1, deep: 2 };
const SEVERITIES = ["info", "warning", "error"];
const NO_OFFSET = 2 ** 64; // UINT64_MAX as a number
const DEFAULT_MAX_MEMORY = 256 * 2 ** 20;
const LARGEST_EDGE = 32768; // pixels of a picture

// Literal addresses, by which bundlers find the files.
const FILES = {
    "pbm.wasm": new URL("./pbm.wasm", import.meta.url),
    "pbm_threads.js": new URL("./pbm_threads.js", import.meta.url),
    "pbm_threads.wasm": new URL("./pbm_threads.wasm", import.meta.url),
    "pbm_threads.worker.js": new URL("./pbm_threads.worker.js", import.meta.url),
    "pbm_validator.js": new URL("./pbm_validator.js", import.meta.url),
    "pbm_validator.wasm": new URL("./pbm_validator.wasm", import.meta.url),
};

function oneOf(names, value, what) {
    if (!Object.hasOwn(names, value)) throw usage(`${what} is ${value}, not ${Object.keys(names).join(", ")}`);
    return names[value];
}

// Addresses of all files: those in `base`, if there is one, but for those that `files` names.
function filesOf({ base, files = {} }) {
    try {
        const own = base ? Object.fromEntries(Object.keys(FILES).map((name) => [name, new URL(name, base)])) : FILES;
        return { ...own, ...files };
    } catch {
        throw new PbmError({ code: CODES.IO, message: `base is ${base}, which is no address of a folder` });
    }
}

async function compiled(name, files) {
    const file = await files[name];
    try {
        return file instanceof WebAssembly.Module ? file : await platform.compile(file);
    } catch (error) {
        throw new PbmError({ code: CODES.IO, message: `${name} cannot be loaded: ${error.message}` });
    }
}

/** Instantiates a module of emscripten. `create`: of its script. `callbacks`: what callbacks.js calls. */
async function instantiate(create, name, files, callbacks) {
    const module = await compiled(`${name}.wasm`, files);
    let memory;
    return new Promise((resolve, reject) => {
        create({
            ...callbacks,
            locateFile: (file) => String(files[file]),
            printErr: platform.warn,
            mainScriptUrlOrBlob: String(files[`${name}.js`]), // for the workers of threads
            instantiateWasm(imports, done) {
                WebAssembly.instantiate(module, imports).then((instance) => {
                    // Imported if threads share it, else exported; emscripten shortens the names.
                    memory = [
                        ...Object.values(imports).flatMap(Object.values),
                        ...Object.values(instance.exports),
                    ].find((value) => value instanceof WebAssembly.Memory);
                    done(instance, module);
                }, reject);
                return {};
            },
        }).then((created) => resolve({ module: created, memory: new Memory(memory, created._malloc) }), reject);
    });
}

async function imported(name, files) {
    try {
        return (await import(String(files[name]))).default;
    } catch (error) {
        throw new PbmError({ code: CODES.IO, message: `${name} cannot be loaded: ${error.message}` });
    }
}

/** Calls of one module, with memory for their arguments that stays where it is. */
class Calls {
    constructor({ module, memory }) {
        this.module = module;
        this.memory = memory;
        this.error = memory.allocate(ERROR.size);
    }

    lastError() {
        const error = this.memory.read(ERROR, this.error);
        return new PbmError({ ...error, offset: error.offset === NO_OFFSET ? null : error.offset });
    }
}

/** An open model: see pbm.d.ts. */
class Model {
    #pbm;
    #handle;
    #source;

    constructor(pbm, handle, source) {
        this.#pbm = pbm;
        this.#handle = handle;
        this.#source = source;
    }

    info() {
        const { calls, scratch } = this.#pbm;
        calls.memory.write(INFO, scratch, {});
        if (!this.#call((error) => calls.module._pbm_get_info(this.#handle, scratch, error))) return null;
        const { structSize, ...info } = calls.memory.read(INFO, scratch);
        return info;
    }

    defaultCamera(width, height) {
        checkSize(width, height);
        const { calls, scratch } = this.#pbm;
        calls.memory.write(CAMERA, scratch, {});
        if (!this.#call((error) => calls.module._pbm_default_camera(this.#handle, width, height, scratch, error)))
            return null;
        const { position, focalPoint, up, viewAngle } = calls.memory.read(CAMERA, scratch);
        return { position, focalPoint, up, viewAngle, orthographic: false };
    }

    render(given) {
        checkObject(given, "render needs { camera, width, height }: see pbm.d.ts for more");
        const pbm = this.#pbm,
            { calls } = pbm,
            { memory } = calls,
            { width, height } = given;
        const camera = pbm.scratch,
            options = camera + CAMERA.size,
            picture = options + OPTIONS.size;
        checkSize(width, height);
        const pixelBytes = 4 * width * height,
            depthCount = given.depths ? width * height : 0;
        const pixels = pbm.room(pixelBytes + 4 * depthCount),
            depths = given.depths ? pixels + pixelBytes : 0;
        const texts = {};
        let code;
        try {
            for (const name of ["colourBy", "dropClass", "showClass"])
                texts[name] = given[name] ? memory.allocateText(given[name]) : 0;
            writeCamera(memory, camera, given.camera);
            writeOptions(memory, options, { ...given, ...texts }, pbm.threads);
            memory.write(PICTURE, picture, { width, height, pixels, pixelBytes, depths, depthCount });
            code = this.#code((error) => calls.module._pbm_render(this.#handle, camera, options, picture, error));
        } finally {
            for (const address of Object.values(texts)) calls.module._free(address);
        }
        let error = null;
        if (code !== CODES.OK) {
            error = calls.lastError();
            const isDrawn =
                code === CODES.INVALID || code === CODES.UNSUPPORTED || (code === CODES.LIMIT && error.name === "");
            if (!isDrawn) throw this.#source.thrown ?? error;
        }
        return {
            pixels: new Uint8ClampedArray(memory.buffer, pixels, pixelBytes),
            depths: given.depths ? new Float32Array(memory.buffer, depths, depthCount) : null,
            complete: error === null && !this.#source.isPending,
            error,
        };
    }

    close() {
        if (this.#handle !== 0) this.#pbm.closeModel(this.#handle, this.#source);
        this.#handle = 0;
    }

    #code(call) {
        this.#source.isPending = false;
        this.#source.thrown = null;
        return call(this.#pbm.calls.error);
    }

    // Whether the call succeeded; false while bytes are pending.
    #call(call) {
        const code = this.#code(call);
        if (code !== CODES.OK && code !== CODES.PENDING) throw this.#source.thrown ?? this.#pbm.calls.lastError();
        return code === CODES.OK;
    }
}

function checkObject(value, message) {
    if (typeof value !== "object" || value === null) throw usage(message);
}

function checkSize(width, height) {
    for (const [name, edge] of Object.entries({ width, height }))
        if (!(Number.isInteger(edge) && edge >= 1 && edge <= LARGEST_EDGE))
            throw usage(`${name} is ${edge}, not a whole number of pixels from 1 to ${LARGEST_EDGE}`);
}

function writeCamera(memory, address, camera) {
    checkObject(camera, "render needs a camera: that of defaultCamera(), or one of your own");
    const { clipPlane, clipBox } = camera;
    memory.write(CAMERA, address, {
        ...camera,
        orthographic: camera.orthographic ? 1 : 0,
        clip: (clipPlane ? CLIP_PLANE : 0) | (clipBox ? CLIP_BOX : 0),
        planePoint: clipPlane?.point,
        planeNormal: clipPlane?.normal,
        boxLowest: clipBox?.lowest,
        boxHighest: clipBox?.highest,
        backs: oneOf(BACKS, camera.backs ?? "auto", "backs"),
    });
}

function writeOptions(memory, address, given, threads) {
    let flags = (given.background ? USE_BACKGROUND : 0) | (given.headlight ? USE_HEADLIGHT : 0) |
        (given.backgroundBelow ? GRADIENT : 0);
    const without = given.without ?? [];
    if (!Array.isArray(without)) throw usage(`without is ${without}, not an array of names`);
    for (const name of without) flags |= oneOf(LEAVE_OUT, name, "without");
    memory.write(OPTIONS, address, {
        quality: oneOf(QUALITIES, given.quality ?? "fast", "quality"),
        depthCue: oneOf(DEPTH_CUES, given.depthCue ?? "auto", "depthCue"),
        shading: oneOf(SHADINGS, given.shading ?? "auto", "shading"),
        lightFollows: oneOf(LIGHT_FOLLOWS, given.lightFollows ?? "default", "lightFollows"),
        colourMap: oneOf(COLOUR_MAPS, given.colourMap ?? "auto", "colourMap"),
        colourBy: given.colourBy,
        colourRange: given.colourRange,
        dropClass: given.dropClass,
        showClass: given.showClass,
        headlight: given.headlight,
        samples: given.samples,
        finestLevel: given.finestLevel,
        maxError: given.maxError,
        background: given.background,
        backgroundBelow: given.backgroundBelow,
        flags,
        threads,
        maxMemory: given.maxMemory ?? DEFAULT_MAX_MEMORY,
    });
}

/** The library: see pbm.d.ts. */
class Pbm {
    #sources = new Map(); // by the context of the callback
    #nextContext = 1;
    #room = 0;
    #roomBytes = 0;

    constructor(threads) {
        this.threads = threads;
    }

    async load(files) {
        const name = this.threads > 1 ? "pbm_threads" : "pbm";
        const create = this.threads > 1 ? await imported("pbm_threads.js", files) : createPbm;
        this.calls = new Calls(
            await instantiate(create, name, files, {
                workers: this.threads - 1,
                pbmRead: (context, offset, size, to) => this.#read(context, Number(offset), Number(size), to),
            }),
        );
        const { memory, module } = this.calls;
        this.scratch = memory.allocate(Math.max(INFO.size, CAMERA.size + OPTIONS.size + PICTURE.size));
        this.version = memory.text(module._pbm_version());
        return this;
    }

    open(from) {
        const { size, read } = from ?? {};
        if (!Number.isSafeInteger(size) || size < 0 || typeof read !== "function")
            throw usage("open needs { size, read }: a number of bytes and a function");
        const { calls, scratch } = this,
            context = this.#nextContext++;
        const source = { read, context, isPending: false, thrown: null };
        this.#sources.set(context, source);
        const code = calls.module._pbm_web_open(context, BigInt(size), scratch, calls.error);
        if (code === CODES.OK)
            return new Model(this, new DataView(calls.memory.buffer).getUint32(scratch, true), source);
        this.#sources.delete(context);
        if (code === CODES.PENDING) return null;
        throw source.thrown ?? calls.lastError();
    }

    openBytes(bytes) {
        if (!(bytes instanceof Uint8Array)) throw usage("openBytes needs a Uint8Array");
        return this.open({ size: bytes.length, read: (offset, size) => bytes.subarray(offset, offset + size) });
    }

    closeModel(handle, source) {
        this.calls.module._pbm_close(handle);
        this.#sources.delete(source.context);
    }

    // Memory for a picture, which the next one takes over.
    room(bytes) {
        if (bytes > this.#roomBytes) {
            this.calls.module._free(this.#room);
            this.#room = this.#roomBytes = 0; // the allocation may fail
            this.#room = this.calls.memory.allocate(bytes);
            this.#roomBytes = bytes;
        }
        return this.#room;
    }

    // No exception may pass through WebAssembly: the call that needed the bytes throws it.
    #read(context, offset, size, to) {
        const source = this.#sources.get(context);
        try {
            const bytes = source.read(offset, size);
            if (bytes === null) {
                source.isPending = true;
                return LATER;
            }
            if (!(bytes instanceof Uint8Array) || bytes.length !== size)
                throw usage(`read(${offset}, ${size}) must return a Uint8Array of ${size} bytes, or null`);
            this.calls.memory.bytes(to, size).set(bytes);
            return 0;
        } catch (thrown) {
            source.thrown ??= thrown;
            return FAILED;
        }
    }
}

/** Loads the library: see pbm.d.ts. */
export async function loadPbm({ threads = "auto", ...places } = {}) {
    const count = threadsOf(threads);
    if (count > 1) await platform.prepareThreads();
    return new Pbm(count).load(filesOf(places));
}

/** Loads the validator: see pbm.d.ts. */
export async function loadValidator(places = {}) {
    let findings = [];
    const files = filesOf(places);
    const calls = new Calls(
        await instantiate(await imported("pbm_validator.js", files), "pbm_validator", files, {
            pbmReport(context, address) {
                const finding = memory.read(FINDING, address);
                findings.push({ ...finding, severity: SEVERITIES[finding.severity] });
                return 0;
            },
        }),
    );
    const { memory, module } = calls,
        scratch = memory.allocate(VALIDATION.size);
    return {
        version: memory.text(module._pbm_version()),
        validate(bytes, { level = "full", maxFindings = 100 } = {}) {
            if (!(bytes instanceof Uint8Array)) throw usage("validate needs a Uint8Array");
            const copy = memory.allocate(Math.max(1, bytes.length));
            try {
                memory.bytes(copy, bytes.length).set(bytes);
                memory.write(VALIDATION, scratch, { level: oneOf(LEVELS, level, "level"), threads: 1, maxFindings });
                findings = [];
                if (module._pbm_web_validate(copy, BigInt(bytes.length), scratch, calls.error) !== CODES.OK)
                    throw calls.lastError();
                const { verdict, errors, warnings, infos, points } = memory.read(VALIDATION, scratch);
                return { verdict, errors, warnings, infos, points, findings };
            } finally {
                module._free(copy);
            }
        },
    };
}
