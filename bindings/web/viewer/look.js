// What attributes say of lights and of the colours of a field, as options of the module.
import { parseAngle } from "./orbit.js";

const SHADINGS = ["auto", "lit", "unlit"];
const LIGHT_FOLLOWS = ["default", "eye", "model"];
const COLOUR_MAPS = ["viridis", "grey", "classes"];

// Whatever else an attribute says is the first word, the default.
export function wordOf(text, words) {
    return words.includes(text) ? text : words[0];
}

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

// The options that the attributes of an element ask for.
export function lookOf(element) {
    return {
        shading: wordOf(element.getAttribute("shading"), SHADINGS),
        lightFollows: wordOf(element.getAttribute("light-follows"), LIGHT_FOLLOWS),
        headlight: headlightOf(element.getAttribute("headlight")),
        ...colouringOf(element.getAttribute("colour-by")),
        dropClass: element.getAttribute("drop-class") ?? "",
        showClass: element.getAttribute("show-class") ?? "",
        without: element.hasAttribute("no-legend") ? ["legend"] : [],
    };
}
