// <pbm-viewer>: shows a binary voxel grid (.pbvg) on a page. Names are those of <model-viewer> where both have the same
// thing.
//
//   <script type="module" src="pbm-viewer/pbm-viewer.js"></script>
//   <pbm-viewer src="scan.pbvg" controls alt="A marble lion"></pbm-viewer>
//
// Attributes
//   src            address of the model
//   alt            what the picture shows, for people who do not see it
//   controls       pointers, wheel and keys move the view; a file that is dropped on the element is shown
//   camera-orbit   "theta phi radius": azimuth (0: in front of the model), polar angle (0: above it) and distance to
//                  the target: "30deg 75deg 105%". Angles in deg or rad; lengths in model units, m, cm, mm, or % of the
//                  distance that shows the whole model from every direction. Each may be "auto": the angles of the
//                  default view, 100%
//   camera-target  "x y z": the point that the camera turns about; lengths or "auto", the centre of the model
//   field-of-view  vertical angle: "30deg"
//   auto-rotate    the model turns while nobody touches it
//   background     a CSS colour; default transparent
//   exposure       stops: light is multiplied by 2^exposure, of all but the background; -10 to 10
//   quality        fast: one colour a point; fine: smooth, as pbm-render draws, once the view rests; auto (default):
//                  as fine as can be drawn in 1.5 seconds
//   backs          show: points are seen from both sides; hide: rooms are seen into from outside; auto (default): shown,
//                  unless the file says that its surface is closed
//   shading        unlit: the colours alone; lit; auto (default): lit, softly if the points have colours and the file no
//                  lights: a surface that faces the eye then keeps its colour
//   light-follows  eye: lights turn with the view and cast no shadows; model: they stay where they are. Default: those
//                  of the file stay, and a file without lights is lit from beside the eye
//   headlight      "RIGHT UP": one light in place of all others, which turns with the view; angles to the right of the eye,
//                  at most 180deg, and above it, at most 90deg: "-60deg 20deg". Anything else: none
//   colour-by      "NAME[,MIN,MAX][,MAP]": points have the colours of height, normal, plain or a field, as pbm-render draws
//                  them; MAP: viridis, grey, classes. A field that the model lacks is an error
//   drop-class     classes of points that are left out: numbers and names of LAS, "noise,ground,31"
//   show-class     classes of points that are drawn alone
//   no-legend      the legend of these colours is left out
//   poster         address of a picture that is shown until the model is; or give an element slot="poster"
//   loading        auto (default) and lazy: once the element comes near the visible part of the page; eager: at once
//   reveal         auto (default): the poster goes with the first picture; manual: with dismissPoster()
//   max-memory     MB that the model may take; default 256
//   disable-zoom   the wheel scrolls the page; else it does so only where the view is as near or as far as it goes
//   touch-action   none: vertical swipes turn the view; by default they scroll the page
//   interaction-prompt  auto: says how to turn the model, until the first input; none (default)
//
// "false" is the value of a Boolean attribute that is not set. A value that an attribute does not know is its default, and
// a warning in the console. Texts are in German where the language of the element is German (lang="de"), else in English.
//
// Children
//   <img slot="poster"> or <picture slot="poster">: a poster that is shown before scripts run, and without them
//   <button slot="hotspot-NAME" data-position="x y z" data-normal="x y z">: stays at this point of the model (lengths
//   as in camera-target). While the picture hides the point, or the normal (optional) leads away from the eye, the
//   element lacks the attribute data-visible, cannot be reached by keys and is drawn with the opacity --min-hotspot-opacity. Changes dispatch
//   hotspot-visibility on it
//
// CSS: --progress-bar-color, --focus-color, --min-hotspot-opacity; parts canvas, input, poster, progress-bar, credit,
// notice, prompt, fullscreen-button, about-button (name and credit of a small element), back-button (from a file that was
// dropped to the page's model).

/** Angles are radians, lengths model units. As text it is a value of the attribute `camera-orbit`. */
export interface Orbit {
    theta: number;
    phi: number;
    radius: number;
    toString(): string;
}

/** Model units. As text it is a value of `camera-target` and `data-position`. */
export interface Point {
    x: number;
    y: number;
    z: number;
    toString(): string;
}

/** What is known of a model: `pbm_info` of pbm.h. */
export interface ModelInfo {
    fileBytes: number;
    points: number;
    depth: number;
    attributes: number;
    origin: [number, number, number];
    voxelSize: number;
    lowest: [number, number, number];
    highest: [number, number, number];
    unit: "m" | "mm" | "cm" | "in" | "ft" | "km" | "unknown";
    up: "+x" | "+y" | "+z";
    /** A JSON object: untrusted text. */
    metadata: string;
    contentId: string;
    fields: number;
    materials: number;
    lights: number;
}

export interface CameraChange {
    /** Each is text as in the attribute, or what a getter returned. Left out: as it is now. */
    orbit?: Orbit | string;
    target?: Point | string;
    /** Degrees, or text with a unit. */
    fieldOfView?: number | string;
}

/** Times are milliseconds. */
export interface Statistics {
    version: string | null;
    /** That draw: 1 without workers for it; 0: the code is not loaded yet. */
    threads: number;
    /** That arrived, and that are kept compressed. */
    bytes: number;
    heldBytes: number;
    requests: number;
    /** Of the picture that is shown; `scale` is below 1 while the view moves on a slow machine. */
    width: number;
    height: number;
    scale: number;
    /** The picture lacks nothing. */
    complete: boolean;
    /** The picture is the last one of this view: as exact as the file allows, and fine if `quality` asks for it. */
    resting: boolean;
    /** Per pixel, of a fine picture; 0: a fast one. */
    samples: number;
    /** Of the last picture of each kind; of a fine one for each sample. */
    fastTime: number;
    fineTime: number;
    movingTime: number;
    /** From the start of the worker to the first picture, and to the first that lacked nothing. */
    firstPictureAfter: number | null;
    exactPictureAfter: number | null;
}

export interface ProgressDetail {
    bytes: number;
    /** 0 .. 1: part of what the first exact picture needs; 1: it is shown. */
    totalProgress: number;
}

export interface ErrorDetail {
    /** Exit code of the programs that means the same (docs/reference/exit-codes.md): 2 I/O, 3 damaged, 4 limit, .. */
    code: number;
    /** One line. */
    message: string;
    /** Byte of the file, or null. */
    offset: number | null;
    /** Of the fault: "hash.chunk", "server.status", "network", .. */
    name: string;
    /** Of BVG.md: "5.6.4", or empty. */
    rule: string;
}

export interface PbmViewerEventMap {
    /** The first picture is shown. It may still become finer. */
    load: CustomEvent<{ url: string | null }>;
    progress: CustomEvent<ProgressDetail>;
    /** A part of the model, or all of it, cannot be shown. What is proven stays visible. */
    error: CustomEvent<ErrorDetail>;
    "camera-change": CustomEvent<{ source: "user-interaction" | "none" }>;
}

export class PbmViewer extends HTMLElement {
    /** Attributes as properties; null: the element lacks the attribute. */
    src: string | null;
    alt: string | null;
    poster: string | null;
    quality: "auto" | "fast" | "fine" | null;
    backs: "auto" | "show" | "hide" | null;
    cameraOrbit: string | null;
    cameraTarget: string | null;
    fieldOfView: string | null;
    background: string | null;
    exposure: number | null;
    shading: "auto" | "lit" | "unlit" | null;
    lightFollows: "eye" | "model" | null;
    headlight: string | null;
    colourBy: string | null;
    dropClass: string | null;
    showClass: string | null;
    loading: "auto" | "lazy" | "eager" | null;
    reveal: "auto" | "manual" | null;
    touchAction: string | null;
    interactionPrompt: "auto" | "none" | null;
    maxMemory: number | null;
    autoRotate: boolean;
    controls: boolean;
    disableZoom: boolean;
    noLegend: boolean;

    /** The event `load` was dispatched. */
    readonly loaded: boolean;
    /** Null before `load`. */
    readonly info: ModelInfo | null;

    /** Shows a model that is not on a server: a file that the user chose. */
    open(model: Blob): void;

    /** These throw an Error before `load`. While the view glides they return where it goes to. */
    getCameraOrbit(): Orbit;
    getCameraTarget(): Point;
    /** Degrees. */
    getFieldOfView(): number;
    setCamera(change: CameraChange, options?: { smooth?: boolean }): void;
    /** Looks as the attributes say. */
    resetCamera(options?: { smooth?: boolean }): void;

    /** Ends `reveal="manual"`. */
    dismissPoster(): void;
    /** The point of the model that the picture shows there (client coordinates, as of a mouse event), or null. */
    positionFromPoint(clientX: number, clientY: number): Promise<Point | null>;
    /** The picture, at full resolution. Null if there is none. */
    toBlob(options?: { mimeType?: string; qualityArgument?: number }): Promise<Blob | null>;
    statistics(): Promise<Statistics | null>;

    addEventListener<Name extends keyof PbmViewerEventMap>(type: Name,
        listener: (this: PbmViewer, event: PbmViewerEventMap[Name]) => unknown,
        options?: boolean | AddEventListenerOptions): void;
    addEventListener<Name extends Exclude<keyof HTMLElementEventMap, keyof PbmViewerEventMap>>(type: Name,
        listener: (this: PbmViewer, event: HTMLElementEventMap[Name]) => unknown,
        options?: boolean | AddEventListenerOptions): void;
    addEventListener(type: string, listener: EventListenerOrEventListenerObject,
        options?: boolean | AddEventListenerOptions): void;
    removeEventListener<Name extends keyof PbmViewerEventMap>(type: Name,
        listener: (this: PbmViewer, event: PbmViewerEventMap[Name]) => unknown,
        options?: boolean | EventListenerOptions): void;
    removeEventListener(type: string, listener: EventListenerOrEventListenerObject,
        options?: boolean | EventListenerOptions): void;
}

declare global {
    interface HTMLElementTagNameMap {
        "pbm-viewer": PbmViewer;
    }
}
