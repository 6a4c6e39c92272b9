// PBM for JavaScript: opens, draws and validates binary voxel grids (.pbvg) in pages, workers and node.
//
//   const pbm = await loadPbm();
//   const model = pbm.openBytes(new Uint8Array(await (await fetch('scan.pbvg')).arrayBuffer()));
//   const camera = model.defaultCamera(640, 480);
//   const { pixels } = model.render({ camera, width: 640, height: 480 });
//   context.putImageData(new ImageData(pixels.slice(), 640), 0, 0);
//   model.close();
//
// Lengths are model units, angles radians, colours sRGB; coordinates are right-handed. Pictures have the bytes of
// pbm-render's, with and without threads. Everything but loading is synchronous: in a page it belongs into a worker,
// above all with threads, for which a page's own thread would wait in a loop.

/** Codes of PbmError: those of pbm.h, which are the exit codes of the programs. */
export const CODES: Readonly<{
    OK: 0;
    USAGE: 1;
    IO: 2;
    INVALID: 3;
    LIMIT: 4;
    UNSUPPORTED: 5;
    CANCELLED: 6;
    PENDING: 7;
}>;

/** Bits of Info.attributes. All points have a normal and a radius. */
export const ATTRIBUTES: Readonly<{
    COLOURS: 1;
    MATERIALS: 2;
    TEXTURE: 4;
    SHADOWS: 8;
    GROUND: 16;
    PANORAMA: 32;
    /** The surface bounds volumes, and normals point out of them: from outside no back of a point is visible. */
    CLOSED: 64;
    ROUND_POINTS: 128;
    SIDES: 256;
    OFFSETS: 512;
}>;

/** What every function throws, beside what a callback throws. */
export class PbmError extends Error {
    /** One of CODES. */
    readonly code: number;
    /** Byte of the file, or null where there is none. */
    readonly offset: number | null;
    /** Of the fault, as in docs/reference/validator-codes.md ("octree.empty_mask"), or empty. */
    readonly name: string;
    /** Of the rule of BVG.md that is broken ("4.2"), or empty. */
    readonly rule: string;
    /** One line. */
    readonly message: string;
}

export type Vector = [x: number, y: number, z: number];

/** A pinhole camera, or an orthographic one that sees as much of the focal point's plane. */
export interface Camera {
    position: Vector;
    /** In the middle of the picture. */
    focalPoint: Vector;
    /** Of any length, not along the line of sight. */
    up: Vector;
    /** Vertical, radians, above 0 and below pi. Default: 30 degrees. */
    viewAngle?: number;
    /** Default: false. */
    orthographic?: boolean;
    /** Cuts the model open: what lies on the side that the normal leads to is kept. */
    clipPlane?: { point: Vector; normal: Vector };
    /** Cuts the model open: what lies inside is kept. */
    clipBox?: { lowest: Vector; highest: Vector };
    /** Whether points that face away from the eye are drawn. "auto" (default): unless the file says that its surface is
     *  closed. "hide": rooms are seen into from outside. */
    backs?: "auto" | "show" | "hide";
}

/** What is known of a model without its points. */
export interface Info {
    fileBytes: number;
    /** Of the finest level. */
    points: number;
    /** Levels are 0, a single point, .. depth, the finest one. */
    depth: number;
    /** Bits of ATTRIBUTES. */
    attributes: number;
    /** Minimum corner of the grid, model units. */
    origin: Vector;
    /** Edge of a finest voxel, model units; 2^(depth - L) times as much at level L. */
    voxelSize: number;
    /** Box around the occupied voxels of level 6, or of the finest one: all points lie inside. */
    lowest: Vector;
    highest: Vector;
    /** Of the model: "m", "mm", "cm", "in", "ft", "km" or "unknown". */
    unit: string;
    /** "+y", "+z" or "+x". */
    up: string;
    /** The text of a JSON object. */
    metadata: string;
    /** 128 bits, hexadecimal: models with the same one hold the same points and scene. */
    contentId: string;
    /** Number of scalar fields. */
    fields: number;
    materials: number;
    lights: number;
}

export interface RenderOptions {
    camera: Camera;
    /** Pixels, 1 .. 32768. */
    width: number;
    height: number;
    /** "fine" blends points into a smooth surface and smooths edges; it takes about ten times as long. Default: "fast". */
    quality?: "fast" | "fine";
    /** Per pixel of fine pictures, 1 .. 256. Default: 8. Where one is enough, one is taken. A picture that differs from the last one of the model in nothing
     *  but a larger number draws only the samples that it has more. */
    samples?: number;
    /** Pixels: largest edge of a drawn voxel that has children. Larger is coarser and faster. Default: 2, of fine pictures 1.42, and less below 1280x720. */
    maxError?: number;
    /** Draws no finer level than this one. Default: all. */
    finestLevel?: number;
    /** sRGB with straight alpha, 0 .. 255 each. Default: 51, 51, 51, 255. */
    background?: [red: number, green: number, blue: number, alpha: number];
    /** At the lower edge, with a gradient from `background` at the upper one. Default: no gradient. */
    backgroundBelow?: [red: number, green: number, blue: number, alpha: number];
    /** Whether to write depths, too. Default: false. */
    depths?: boolean;
    /** Bytes of decoded points that are kept for the next pictures. Another value than for the last picture reads
     *  everything anew. Default: 256 MiB. */
    maxMemory?: number;
    /** Shows the shape of models without colours. Default: "auto", eye-dome for clouds of points without faces, colours
     *  and normals, else none. */
    depthCue?: "auto" | "none" | "eye-dome" | "ambient-occlusion";
    /** "eye": lights turn with the camera and cast no shadows; "model": they stay where they are. Default: those of the
     *  file stay, and a file without lights is lit from beside the eye. */
    lightFollows?: "default" | "eye" | "model";
    /** "unlit": the colours alone; "lit"; "auto", the default: lit, softly if the points have colours and the file no
     *  lights: a surface that faces the eye then keeps its colour. */
    shading?: "auto" | "lit" | "unlit";
    /** One light in place of all others, which follows the camera: where it comes from, to the right of the eye, -pi ..
     *  pi, and above it, -pi/2 .. pi/2. Default: none. */
    headlight?: [right: number, up: number];
    /** Points have the colours of its values, and the picture a legend: name of a field, "class" or "return" of a laser;
     *  "height", "normal", or "plain", their material. Default: their own colours; "height" where depthCue "auto" is
     *  eye-dome. With another field, range or map than for the last picture everything is read anew. */
    colourBy?: string;
    /** Values with the first and the last colour, ascending. Default: most values lie between. */
    colourRange?: [least: number, most: number];
    /** "classes": a colour for each label. Default: "auto", classes for a field of labels, grey
     *  for intensities, else viridis. */
    colourMap?: "auto" | "viridis" | "grey" | "classes";
    /** Classes of points that are left out: numbers and names of LAS, "noise,ground,31". With others than for the last
     *  picture everything is read anew. */
    dropClass?: string;
    /** Classes of points that are drawn alone. */
    showClass?: string;
    /** What to leave out. */
    without?: Array<"texture" | "colours" | "shadows" | "ground" | "panorama" | "reflections" | "legend">;
}

export interface Picture {
    /** [height][width][4], top row first: red, green, blue, straight alpha. A view of memory that the next picture of
     *  the same Pbm overwrites; with threads the memory is shared, so copy it (slice()) for ImageData. */
    pixels: Uint8ClampedArray;
    /** [height][width] distances along the view, model units, Infinity where nothing is; null if not asked for. A view
     *  as `pixels` is. */
    depths: Float32Array | null;
    /** Whether the picture is exact: no byte was pending and `error` is null. */
    complete: boolean;
    /** Why the picture lacks something that no further byte will bring. INVALID or UNSUPPORTED: the first damage that
     *  any picture of the model met; coarser levels stand in for damaged parts. LIMIT: the picture needs more than
     *  `maxMemory`, and shows what fits; a larger `maxError` needs less. */
    error: PbmError | null;
}

/** Where the bytes of a model come from. */
export interface Source {
    /** Of the file, bytes. */
    size: number;
    /** Returns `size` bytes from `offset` on, or null: they have not arrived yet. Called during open, info,
     *  defaultCamera and render, most urgent range first; a call that gets null asks for all other ranges that it knows
     *  it needs, too. Ranges may be asked for again. What it throws is thrown by the call that needs the bytes. It must
     *  not call functions of the model. */
    read(offset: number, size: number): Uint8Array | null;
}

/** An open model. */
export interface Model {
    /** Null while bytes are pending: call again when those that `read` was asked for are there. */
    info(): Info | null;
    /** A camera in front of the model that sees all of it in a picture of this size. Null while bytes are pending. */
    defaultCamera(width: number, height: number): Camera | null;
    /** Draws what is there, and asks `read` for what the picture lacks.
     *  @throws PbmError USAGE for options that are none and cameras that see nothing; LIMIT if memory runs out */
    render(options: RenderOptions): Picture;
    /** Frees its memory. A closed model throws PbmError USAGE. Closing it again does nothing. */
    close(): void;
}

/** The library in one WebAssembly memory. */
export interface Pbm {
    readonly version: string;
    /** Threads that draw; 1: without workers. */
    readonly threads: number;
    /** Reads header and small sections. Null while they are pending: call again, which asks for them again.
     *  @throws PbmError INVALID, UNSUPPORTED */
    open(source: Source): Model | null;
    /** The same of a whole file, of which only what is needed is copied. The array must stay unchanged. */
    openBytes(bytes: Uint8Array): Model;
}

/**
 * Loads the library: pbm.wasm, or with threads pbm_threads.js, pbm_threads.worker.js and pbm_threads.wasm. What the network
 * or an overloaded server is to blame for is tried again.
 *
 * @param options.threads 'auto': as many as processors, at most 16, where the page is cross-origin isolated, and in node;
 *     0 or 1: none; n: as many. Where there is no shared memory: none. Default: 'auto'.
 *     The first model of a Pbm that is drawn has them; a further one beside it is drawn by one thread.
 * @param options.base folder of these files. Default: that of pbm.js.
 * @param options.files addresses of files that lie elsewhere, by name; in place of a .wasm file also what it compiles to.
 * @throws PbmError IO if a file is not there
 */
export function loadPbm(options?: Places & { threads?: "auto" | number }): Promise<Pbm>;

export interface Places {
    base?: URL | string;
    files?: Record<string, URL | string | WebAssembly.Module | Promise<WebAssembly.Module>>;
}

export interface Finding {
    /** Only errors make a file invalid. */
    severity: "info" | "warning" | "error";
    /** Of an error: one of CODES. */
    code: number;
    /** Byte of the file. */
    offset: number;
    /** As in docs/reference/validator-codes.md: "octree.empty_mask". */
    name: string;
    /** Of BVG.md: "4.2"; empty for advice. */
    rule: string;
    /** "header", "level 7 chunks", .. */
    section: string;
    /** One line each. */
    message: string;
    remedy: string;
}

export interface Verdict {
    /** 0: the file is valid; else the code of the gravest error. */
    verdict: number;
    /** Also those beyond maxFindings. */
    errors: number;
    warnings: number;
    infos: number;
    /** Verified. */
    points: number;
    /** In the order of the file. */
    findings: Finding[];
}

/** The verdicts of pbm-validate. */
export interface Validator {
    readonly version: string;
    /** @param options.level "quick": header and section table; "full": every rule of points, images and tree; "deep":
     *      also the averages of coarser levels, and advice. Default: "full".
     *  @param options.maxFindings default: 100
     *  @throws PbmError LIMIT if memory runs out: it needs room for the file and its points, 4 GiB at most */
    validate(bytes: Uint8Array, options?: { level?: "quick" | "full" | "deep"; maxFindings?: number }): Verdict;
}

/** Loads pbm_validator.js and pbm_validator.wasm. Options and errors as of loadPbm. */
export function loadValidator(options?: Places): Promise<Validator>;
