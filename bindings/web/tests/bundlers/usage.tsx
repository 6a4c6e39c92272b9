// JSX of React 19 knows the element: `tsc` accepts this, and refuses the lines after @ts-expect-error.
import type {} from "pbm-viewer/react";

export const page = (
    <pbm-viewer src="lion.pbvg" quality="fine" cameraOrbit="30deg auto 105%" camera-target="auto auto auto" controls
        maxMemory={300} className="scan" onload={(event) => event.detail.url?.length} style={{ width: "100%" }}>
        <button slot="hotspot-paw" data-position="0 0 0">paw</button>
    </pbm-viewer>
);
// @ts-expect-error
export const wrong = <pbm-viewer quality="best" />;
