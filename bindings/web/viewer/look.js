// What attributes say of lights and of the colours of a field, as options of the module.
import { parseAngle } from "./orbit.js";
import { isOn, warnOnce, wordOf } from "./properties.js";

const COLOUR_MAPS = ["viridis", "grey", "classes"];

// "RIGHT UP", two angles -> radians; null where it says anything else.
export function headlightOf(text) {
    try {
        const [right, up, ...more] = (text ?? "").trim().split(/\s+/).map(parseAngle);
        const isThere = more.length === 0 && Math.abs(right) <= Math.PI && Math.abs(up) <= Math.PI / 2;
        return isThere && right !== null && up !== null ? [right, up] : null;
    } catch {
        return null;
    }
}

// "NAME[,MIN,MAX][,MAP]", as pbm-render --colour-by. Read from the end: a name may have commas.
export function colouringOf(text) {
    const parts = (text ?? "").split(",");
    const colouring = {};
    if (parts.length > 1 && COLOUR_MAPS.includes(parts.at(-1))) colouring.colourMap = parts.pop();
    const ends = parts.length > 2 ? parts.slice(-2) : [];
    if (ends.length > 0 && ends.every((end) => end.trim() !== "" && Number.isFinite(Number(end))))
        colouring.colourRange = parts.splice(-2).map(Number);
    return { ...colouring, colourBy: parts.join(",") };
}

const MOST_STOPS = 10;

// Stops, as pbm-render --exposure.
export function exposureOf(element) {
    const text = element.getAttribute("exposure") ?? "";
    const stops = text.trim() === "" ? 0 : Number(text);
    if (Math.abs(stops) <= MOST_STOPS) return stops;
    warnOnce(element, "exposure", text, "is no number of stops, -10 to 10");
    return 0;
}

// The options that the attributes of an element ask for.
export function lookOf(element) {
    const text = element.getAttribute("headlight");
    const headlight = headlightOf(text);
    if (text && !headlight) warnOnce(element, "headlight", text, 'is no light: write "-60deg 20deg"');
    return {
        shading: wordOf(element, "shading"),
        lightFollows: wordOf(element, "light-follows"),
        headlight,
        ...colouringOf(element.getAttribute("colour-by")),
        dropClass: element.getAttribute("drop-class") ?? "",
        showClass: element.getAttribute("show-class") ?? "",
        without: isOn(element, "no-legend") ? ["legend"] : [],
    };
}
