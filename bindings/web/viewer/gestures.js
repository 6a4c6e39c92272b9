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
// have `smooth` as their last argument set to true. `isZoomed()` says whether the wheel belongs to the view or to the
// page.

const ARROW_STEP = 0.05; // picture heights
const KEY_ZOOM = 1.2;
const WHEEL_ZOOM = 0.0015; // per pixel of scrolling
const TAP_TIME = 300; // ms
const TAP_DISTANCE = 12; // CSS pixels
const LINE = 16; // CSS pixels of a line of scrolling

// Listens until the signal aborts.
export function listen(element, actions, isZoomed, signal) {
    const pointers = new Map(); // by id: {x, y}
    let lastTap = { time: -Infinity, x: 0, y: 0 };
    let press = null; // a tap, as long as the pointer stays where it came down
    const on = (name, handler, options = {}) => element.addEventListener(name, handler, { signal, ...options });

    // Middle of the pointers and their mean distance from it.
    const grip = () => {
        const all = [...pointers.values()];
        const x = all.reduce((sum, p) => sum + p.x, 0) / all.length;
        const y = all.reduce((sum, p) => sum + p.y, 0) / all.length;
        return { x, y, spread: all.reduce((sum, p) => sum + Math.hypot(p.x - x, p.y - y), 0) / all.length };
    };

    on("pointerdown", (event) => {
        if (event.button === 1 || pointers.size === 2) return;
        element.setPointerCapture(event.pointerId);
        pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
        press = pointers.size === 1 && event.button === 0 ? { x: event.clientX, y: event.clientY } : null;
    });
    on("pointermove", (event) => {
        if (!pointers.has(event.pointerId)) return;
        const before = grip();
        pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
        const now = grip();
        const height = element.clientHeight;
        const right = (now.x - before.x) / height;
        const down = (now.y - before.y) / height;
        if (press && Math.hypot(event.clientX - press.x, event.clientY - press.y) > TAP_DISTANCE) press = null;
        // A finger may still tap, or the browser take its motion to scroll the page.
        if (press && event.pointerType === "touch") return;
        if (pointers.size === 2) {
            actions.pan(right, down);
            if (before.spread > 0 && now.spread > 0) actions.zoom(now.spread / before.spread, now.x, now.y);
        } else if (event.buttons & 2 || event.shiftKey) {
            actions.pan(right, down);
        } else {
            actions.turn(right, down);
        }
    });
    const release = (event) => {
        if (!pointers.delete(event.pointerId) || event.type === "pointercancel" || !press) return;
        const tap = { time: event.timeStamp, x: press.x, y: press.y };
        press = null;
        if (tap.time - lastTap.time < TAP_TIME && Math.hypot(tap.x - lastTap.x, tap.y - lastTap.y) < TAP_DISTANCE) {
            actions.focus(tap.x, tap.y);
            tap.time = -Infinity;
        }
        lastTap = tap;
    };
    on("pointerup", release);
    on("pointercancel", release);
    on("contextmenu", (event) => event.preventDefault());
    on(
        "wheel",
        (event) => {
            if (!isZoomed()) return;
            event.preventDefault();
            const pixels = event.deltaY * (event.deltaMode === WheelEvent.DOM_DELTA_LINE ? LINE : 1);
            // Pinches of a touchpad come as a wheel with Ctrl, in small steps.
            const factor = Math.exp(-Math.max(-200, Math.min(200, pixels)) * WHEEL_ZOOM * (event.ctrlKey ? 5 : 1));
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
        event.preventDefault();
    });
}
