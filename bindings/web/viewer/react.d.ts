// <pbm-viewer> in JSX, for React 19: write `import type {} from "pbm-viewer/react";` in one file of your project.
import type { DetailedHTMLProps, HTMLAttributes } from "react";
import type { PbmViewer, PbmViewerEventMap } from "./pbm-viewer.js";

type Writable = Pick<
    PbmViewer,
    | "src"
    | "alt"
    | "poster"
    | "quality"
    | "backs"
    | "cameraOrbit"
    | "cameraTarget"
    | "fieldOfView"
    | "background"
    | "exposure"
    | "lightFollows"
    | "headlight"
    | "colourBy"
    | "loading"
    | "reveal"
    | "touchAction"
    | "interactionPrompt"
    | "maxMemory"
    | "autoRotate"
    | "controls"
    | "disableZoom"
    | "noLegend"
>;
type Events = { [Name in keyof PbmViewerEventMap as `on${Name}`]?: (event: PbmViewerEventMap[Name]) => void };

/** Properties as React sets them, attributes as HTML writes them, and the element's events: `onload`, `oncamera-change`. */
export type PbmViewerProps = DetailedHTMLProps<HTMLAttributes<PbmViewer>, PbmViewer> &
    Partial<Writable> &
    Events & { [attribute: `${string}-${string}`]: unknown };

declare module "react" {
    namespace JSX {
        interface IntrinsicElements {
            "pbm-viewer": PbmViewerProps;
        }
    }
}
