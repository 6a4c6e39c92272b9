// What <pbm-viewer> consists of. It is made by calls of the DOM: pages that require trusted types refuse markup.

const STYLES = `
:host { display: block; position: relative; contain: strict; container-type: size; width: 300px; height: 150px;
    aspect-ratio: 4 / 3; overflow: hidden; }
:host([hidden]) { display: none; }
canvas, #ground, #poster, #input, #paper, #hotspots { position: absolute; inset: 0; width: 100%; height: 100%; }
/* A shape that changed shows the whole last picture until there is the next one. */
canvas, #paper { display: block; object-fit: contain; }
#paper { display: none; pointer-events: none; }
.corner { position: absolute; left: 0; top: 0; width: 0; height: 0; visibility: hidden; }
.corner.right { left: 100%; }
.corner.bottom { top: 100%; }
#input { outline: none; touch-action: auto; }
#input.controlled { cursor: grab; touch-action: pan-y; }
:host([touch-action="none"]) #input.controlled { touch-action: none; }
#input.controlled:active { cursor: grabbing; }
/* Two colours, of which one is seen on any picture; forced colours replace the outline's and leave out the shadow. */
#input:focus-visible { outline: 3px solid var(--focus-color, #2a6fdb); outline-offset: -3px;
    box-shadow: inset 0 0 0 5px #fff; }
#poster { transition: opacity 0.3s, visibility 0.3s; pointer-events: none; }
#poster.gone { opacity: 0; visibility: hidden; }
:is(canvas, #hotspots):has(~ #poster:not(.gone)) { visibility: hidden; }
#poster img, ::slotted([slot="poster"]) { width: 100%; height: 100%; object-fit: contain; display: block; }
#hotspots { pointer-events: none; }
.hotspot { position: absolute; left: 0; top: 0; width: max-content; pointer-events: auto; transition: opacity 0.3s; }
.hotspot.hidden { opacity: var(--min-hotspot-opacity, 0.25); pointer-events: none; }
.hotspot.away { visibility: hidden; }
#bar { position: absolute; left: 0; top: 0; height: 4px; width: 100%; transform-origin: left; transform: scaleX(0);
    background: var(--progress-bar-color, #2a6fdb); border-bottom: 1px solid #fff; box-sizing: border-box; transition: opacity 0.3s 0.3s; pointer-events: none; }
#bar.gone { opacity: 0; }
#credit { position: absolute; left: 0; bottom: 0; max-width: calc(100% - 4em); font: 11px/1.4 system-ui, sans-serif;
    color: #fff; }
#notice { display: flex; position: absolute; left: 0; right: 0; top: 0; padding: 0.4em 1em; font: 13px/1.4 system-ui, sans-serif;
    color: #fff; background: rgba(120, 20, 20, 0.85); overflow-wrap: anywhere; }
#notice:has(:first-child:empty) { display: none; }
#message { flex: 1; min-width: 0; display: -webkit-box; -webkit-box-orient: vertical; -webkit-line-clamp: 2;
    overflow: hidden; max-height: 2.8em; }
#notice button { align-self: start; min-width: 24px; min-height: 24px; margin: -0.2em -0.8em 0 0.6em; border: 0;
    color: inherit; background: none; font: inherit; cursor: pointer; }
#credit bdi { display: inline-block; padding: 0.15em 0.6em; background: rgba(0, 0, 0, 0.55); }
#credit a { color: inherit; }
.button { position: absolute; min-width: 32px; height: 32px; padding: 6px; border: 0; border-radius: 4px; color: #fff;
    background: rgba(0, 0, 0, 0.55); font: 13px/20px system-ui, sans-serif; cursor: pointer; }
.button[hidden] { display: none; }
.button:focus-visible, #notice button:focus-visible, #credit a:focus-visible { outline: 3px solid var(--focus-color, #2a6fdb);
    box-shadow: 0 0 0 5px #fff; }
#fullscreen { right: 6px; bottom: 6px; width: 32px; }
#about { display: none; left: 6px; bottom: 6px; width: 32px; font-weight: bold; }
#back { left: 6px; top: 10px; }
#prompt { position: absolute; left: 50%; bottom: 12%; transform: translateX(-50%); padding: 0.4em 1em; border-radius: 2em;
    font: 14px/1.4 system-ui, sans-serif; color: #fff; background: rgba(0, 0, 0, 0.55); pointer-events: none;
    white-space: nowrap; transition: opacity 0.3s, visibility 0.3s; }
#prompt.gone { opacity: 0; visibility: hidden; }
.button svg { display: block; width: 100%; height: 100%; fill: none; stroke: currentColor; stroke-width: 2; }
#spoken { position: absolute; width: 1px; height: 1px; overflow: hidden; clip-path: inset(50%); }
#input:not(.controlled) ~ :is(#fullscreen, #spoken, #prompt) { display: none; }
/* There is no room for name and credit beside the model. */
@container (max-width: 299px) or (max-height: 199px) {
    #about:not([hidden]) { display: block; }
    #about:not([aria-expanded="true"]) ~ #credit { display: none; }
    #credit { bottom: 44px; max-width: 100%; }
}
@media (prefers-reduced-motion: reduce) { * { transition: none !important; } }
@media (forced-colors: active) {
    #bar { background: Highlight; }
    .button, #prompt, #credit bdi { border: 1px solid ButtonText; }
}
@media print {
    :host { break-inside: avoid; }
    .button, #bar, #notice, #prompt { display: none !important; }
    #paper.ready { display: block; }
    canvas:has(~ #paper.ready) { visibility: hidden; }
    #about ~ #credit { display: block !important; bottom: 0; max-width: 100%; }
    #credit bdi { color: #000; background: #fff; }
}
`;

// An element: "tag.class", its attributes, its children.
function make(name, attributes, ...children) {
    const [tag, ...classes] = name.split(".");
    const element = tag.startsWith("svg:")
        ? document.createElementNS("http://www.w3.org/2000/svg", tag.slice(4))
        : document.createElement(tag);
    if (classes.length > 0) element.classList.add(...classes);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    element.append(...children);
    return element;
}

function button(id, ...children) {
    return make("button.button", { id, part: `${id}-button`, type: "button" }, ...children);
}

// A Content-Security-Policy that forbids styles in a page allows those of scripts.
let styles = null;

// Fills a shadow root. Returns its elements by their id, and `corners`: see place.js.
export function build(root) {
    if (styles === null) (styles = new CSSStyleSheet()).replaceSync(STYLES);
    root.adoptedStyleSheets = [styles];
    const frame = make("svg:path", { d: "M2 7V2h5M13 2h5v5M18 13v5h-5M7 18H2v-5" });
    const corners = ["", ".right", ".bottom"].map((corner) => make(`div.corner${corner}`, {}));
    root.append(
        make("div", { id: "ground" }),
        ...corners,
        make("div", { id: "input", part: "input", tabindex: "0" }),
        make("canvas", { id: "paper" }),
        make("div", { id: "hotspots" }),
        make("div", { id: "poster", part: "poster" }, make("slot", { name: "poster" })),
        make("div.gone", { id: "bar", part: "progress-bar" }),
        button("about", "i"),
        make("div", { id: "credit", part: "credit" }),
        make("div.gone", { id: "prompt", part: "prompt", "aria-hidden": "true" }),
        button("back"),
        make(
            "div",
            { id: "notice", part: "notice" },
            make("span", { id: "message", role: "status" }),
            make("button", { id: "dismiss", type: "button" }, "✕"),
        ),
        button("fullscreen", make("svg:svg", { viewBox: "0 0 20 20", "aria-hidden": "true" }, frame)),
        make("div", { id: "spoken", "aria-live": "polite" }),
        make("slot", {}),
    );
    const parts = Object.fromEntries([...root.querySelectorAll("[id]")].map((element) => [element.id, element]));
    return { ...parts, corners };
}
