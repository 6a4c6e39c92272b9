// What <pbm-viewer> consists of.

// A Content-Security-Policy that forbids styles in a page allows those of scripts.
export const styles = new CSSStyleSheet();
styles.replaceSync(`
:host { display: block; position: relative; contain: strict; width: 300px; height: 150px; overflow: hidden; }
:host([hidden]) { display: none; }
canvas, #poster, #input, #hotspots { position: absolute; inset: 0; width: 100%; height: 100%; }
canvas { display: block; }
#input { outline: none; touch-action: auto; }
:host([controls]) #input { cursor: grab; touch-action: pan-y; }
:host([controls][touch-action="none"]) #input { touch-action: none; }
:host([controls]) #input:active { cursor: grabbing; }
#input:focus-visible { box-shadow: inset 0 0 0 3px var(--focus-color, #2a6fdb); }
#poster { transition: opacity 0.3s, visibility 0.3s; pointer-events: none; }
#poster.gone { opacity: 0; visibility: hidden; }
:is(canvas, #hotspots):has(~ #poster:not(.gone)) { visibility: hidden; }
#poster img, ::slotted([slot="poster"]) { width: 100%; height: 100%; object-fit: contain; display: block; }
#hotspots { pointer-events: none; }
.hotspot { position: absolute; left: 0; top: 0; width: max-content; pointer-events: auto; transition: opacity 0.3s; }
.hotspot.hidden { opacity: var(--min-hotspot-opacity, 0.25); pointer-events: none; }
.hotspot.away { visibility: hidden; }
#bar { position: absolute; left: 0; top: 0; height: 3px; width: 100%; transform-origin: left; transform: scaleX(0);
    background: var(--progress-bar-color, rgba(0, 0, 0, 0.4)); transition: opacity 0.3s 0.3s; pointer-events: none; }
#bar.gone { opacity: 0; }
#credit { position: absolute; left: 0; bottom: 0; max-width: calc(100% - 3em); font: 11px/1.4 system-ui, sans-serif;
    color: #fff; }
#notice { display: flex; position: absolute; left: 0; right: 0; top: 0; padding: 0.5em 1em; font: 13px/1.4 system-ui, sans-serif;
    color: #fff; background: rgba(120, 20, 20, 0.85); overflow-wrap: anywhere; }
#notice:has(:first-child:empty) { display: none; }
#message { flex: 1; min-width: 0; }
#notice button { align-self: start; margin: -0.2em -0.6em 0 0.6em; border: 0; color: inherit; background: none;
    font: inherit; cursor: pointer; }
#credit bdi { display: inline-block; padding: 0.15em 0.6em; background: rgba(0, 0, 0, 0.55); }
#credit a { color: inherit; }
#fullscreen { position: absolute; right: 6px; bottom: 6px; width: 32px; height: 32px; padding: 6px; border: 0;
    border-radius: 4px; color: #fff; background: rgba(0, 0, 0, 0.4); cursor: pointer; }
#fullscreen svg { display: block; width: 100%; height: 100%; fill: none; stroke: currentColor; stroke-width: 2; }
#spoken { position: absolute; width: 1px; height: 1px; overflow: hidden; clip-path: inset(50%); }
:host(:not([controls])) #fullscreen, :host(:not([controls])) #spoken { display: none; }
@media (prefers-reduced-motion: reduce) { * { transition: none !important; } }
`);

export const template = document.createElement("template");
template.innerHTML = `
<div id="input" part="input" tabindex="0"></div>
<div id="hotspots"></div>
<div id="poster" part="poster"><slot name="poster"></slot></div>
<div id="bar" part="progress-bar" class="gone"></div>
<div id="credit" part="credit"></div>
<div id="notice" part="notice"><span id="message" role="status"></span><button id="dismiss" type="button"
aria-label="Close">✕</button></div>
<button id="fullscreen" part="fullscreen-button" type="button" aria-label="Full screen">
<svg viewBox="0 0 20 20" aria-hidden="true"><path d="M2 7V2h5M13 2h5v5M18 13v5h-5M7 18H2v-5"/></svg></button>
<div id="spoken" aria-live="polite"></div>
<slot></slot>
`;
