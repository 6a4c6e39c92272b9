// Turns pointers, wheel and keys over an element into changes of the view:
//
//   turn(right, down)  drag with the left button or one finger; arrow keys
//   pan(right, down)   drag with the right button, with shift, or with two fingers; arrow keys with shift
//   zoom(factor, x, y) wheel, pinch, plus and minus: what is seen at client coordinates x, y becomes this many times as
//                      large; keys give no place
//   focus(x, y)        double click or double tap: client coordinates
//   reset()            Home
//
// `actions` has these functions. Lengths are picture heights. Changes by drag and pinch are to be shown at once; others
// have `smooth` as their last argument set to true. `actions.takesWheel(factor)` says whether the wheel belongs to the view
// or to the page, `actions.begun()` hears of each input.

const ARROW_STEP = 0.05; // picture heights
const KEY_ZOOM = 1.2;
const WHEEL_ZOOM = 0.0015; // per pixel of scrolling
const TAP_TIME = 300; // ms
const TAP_DISTANCE = 12; // CSS pixels
const LINE = 16; // CSS pixels of a line of scrolling

// Whether a vertical swipe over the element scrolls something. What a frame lies in may scroll, too.
function isScrollable(element) {
    if (getComputedStyle(element).touchAction === "none") return false;
    if (window !== window.top) return true;
    for (let at = element; at; at = at.parentElement ?? at.getRootNode().host)
        if (at.scrollHeight > at.clientHeight + 1 && /auto|scroll/.test(getComputedStyle(at).overflowY)) return true;
    return document.scrollingElement.scrollHeight > window.innerHeight + 1;
}

// Listens until the signal aborts. `place`: a Place of the element.
export function listen(element, place, actions, signal) {
    const pointers = new Map(); // by id: {x, y, clientX, clientY}: picture heights in the element, client coordinates
    let isScroll = false; // the finger scrolls the page
    let lastTap = { time: -Infinity, x: 0, y: 0 };
    let press = null; // a tap, as long as the pointer stays where it came down
    const placeOf = ({ clientX, clientY }) => {
        const { x, y } = place.partsOf(clientX, clientY);
        return { x: (x * element.clientWidth) / element.clientHeight, y, clientX, clientY };
    };
    const on = (name, handler, options = {}) => element.addEventListener(name, handler, { signal, ...options });

    // Middle of the pointers and their mean distance from it.
    const grip = () => {
        const all = [...pointers.values()];
        const [x, y, clientX, clientY] = ["x", "y", "clientX", "clientY"].map(
            (name) => all.reduce((sum, p) => sum + p[name], 0) / all.length,
        );
        return { x, y, clientX, clientY, spread: all.reduce((sum, p) => sum + Math.hypot(p.x - x, p.y - y), 0) / all.length };
    };

    on("pointerdown", (event) => {
        if (event.button === 1 || pointers.size === 2) return;
        element.setPointerCapture(event.pointerId);
        pointers.set(event.pointerId, placeOf(event));
        isScroll = false;
        press = pointers.size === 1 && event.button === 0 ? { x: event.clientX, y: event.clientY } : null;
        actions.begun();
    });
    on("pointermove", (event) => {
        if (!pointers.has(event.pointerId)) return;
        // The button was released where nobody told: outside of a frame, or over another window.
        if (event.pointerType === "mouse" && event.buttons === 0) return forget(event);
        const before = grip();
        pointers.set(event.pointerId, placeOf(event));
        const now = grip();
        const right = now.x - before.x;
        const down = now.y - before.y;
        if (press) {
            const [x, y] = [event.clientX - press.x, event.clientY - press.y];
            if (Math.hypot(x, y) > TAP_DISTANCE) {
                press = null;
                // The first direction of a finger decides: up and down scroll the page, which then ends the gesture.
                isScroll = event.pointerType === "touch" && Math.abs(y) > Math.abs(x) && isScrollable(element);
            }
        }
        // A finger may still tap.
        if (isScroll || (press && event.pointerType === "touch")) return;
        if (pointers.size === 2) {
            actions.pan(right, down);
            if (before.spread > 0 && now.spread > 0)
                actions.zoom(now.spread / before.spread, now.clientX, now.clientY);
        } else if (event.buttons & 2 || event.shiftKey) {
            actions.pan(right, down);
        } else {
            actions.turn(right, down);
        }
    });
    const forget = (event) => {
        pointers.delete(event.pointerId);
        press = null;
    };
    const release = (event) => {
        if (!pointers.delete(event.pointerId) || !press) return;
        const tap = { time: event.timeStamp, x: press.x, y: press.y };
        press = null;
        if (tap.time - lastTap.time < TAP_TIME && Math.hypot(tap.x - lastTap.x, tap.y - lastTap.y) < TAP_DISTANCE) {
            actions.focus(tap.x, tap.y);
            tap.time = -Infinity;
        }
        lastTap = tap;
    };
    on("pointerup", release);
    on("pointercancel", forget);
    on("lostpointercapture", forget);
    on("contextmenu", (event) => event.preventDefault());
    on(
        "wheel",
        (event) => {
            const pixels = event.deltaY * (event.deltaMode === WheelEvent.DOM_DELTA_LINE ? LINE : 1);
            // Pinches of a touchpad come as a wheel with Ctrl, in small steps.
            const factor = Math.exp(-Math.max(-200, Math.min(200, pixels)) * WHEEL_ZOOM * (event.ctrlKey ? 5 : 1));
            // A page that scrolls already goes on.
            if (!event.cancelable || !actions.takesWheel(factor)) return;
            event.preventDefault();
            actions.begun();
            actions.zoom(factor, event.clientX, event.clientY, true);
        },
        { passive: false },
    );
    on("keydown", (event) => {
        if (event.ctrlKey || event.altKey || event.metaKey) return;
        const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
        const arrow = arrows[event.key]?.map((x) => x * ARROW_STEP);
        if (arrow) (event.shiftKey ? actions.pan : actions.turn)(...arrow, true);
        else if (event.key === "+" || event.key === "=" || event.key === "PageUp") actions.zoom(KEY_ZOOM, null, null, true);
        else if (event.key === "-" || event.key === "_" || event.key === "PageDown") actions.zoom(1 / KEY_ZOOM, null, null, true);
        else if (event.key === "Home") actions.reset();
        else return;
        actions.begun();
        event.preventDefault();
    });
}
