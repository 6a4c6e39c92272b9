// The camera that turns about a target, in the words of <model-viewer>: theta (azimuth, radians; 0: in front of the
// model), phi (polar angle, radians; 0: above it) and the radius (distance to the target, model units).
import { filled } from "./texts.js";

const add = (a, b, factor = 1) => a.map((x, i) => x + b[i] * factor);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const scaled = (a, factor) => a.map((x) => x * factor);
const clamp = (x, low, high) => Math.min(Math.max(x, low), high);

// Up and front directions of models, as the default camera takes them.
const UP = { "+x": [1, 0, 0], "+y": [0, 1, 0], "+z": [0, 0, 1] };
const FRONT = { "+x": [0, 0, 1], "+y": [0, 0, 1], "+z": [0, -1, 0] };

// Metres of a unit; a model of unknown unit is taken to be in metres.
const METRES = { m: 1, cm: 0.01, mm: 0.001, km: 1000, in: 0.0254, ft: 0.3048, unknown: 1 };

const LARGEST = 1e100; // number in an attribute: what is computed from it stays finite

// The view may come as near as this part of the model's bounding sphere's radius, but not nearer than this many voxels:
// there is nothing between them. It may go as far as this many radii.
const NEAREST = 1 / 1000;
const NEAREST_VOXELS = 4;
const FARTHEST = 50;

// What orbits need of a model: `info` as Model.info() returns it.
export function stageOf(info) {
    const up = UP[info.up];
    const front = FRONT[info.up];
    const centre = scaled(add(info.lowest, info.highest), 0.5);
    const size = Math.hypot(...add(info.highest, info.lowest, -1)) / 2;
    return {
        up,
        front,
        right: cross(up, front),
        centre,
        size,
        nearest: Math.max(size * NEAREST, info.voxelSize * NEAREST_VOXELS),
        metre: 1 / METRES[info.unit], // model units
    };
}

// The orbit {theta, phi, radius, target, viewAngle} of a camera.
export function orbitOf(camera, { up, front, right }) {
    const away = add(camera.position, camera.focalPoint, -1);
    const radius = Math.hypot(...away);
    return {
        theta: Math.atan2(dot(away, right), dot(away, front)),
        phi: Math.acos(clamp(dot(away, up) / radius, -1, 1)),
        radius,
        target: [...camera.focalPoint],
        viewAngle: camera.viewAngle,
    };
}

// The camera of an orbit. Its up direction is that of the meridian, so that there is one above the poles too.
export function cameraOf({ theta, phi, radius, target, viewAngle }, { up, front, right }) {
    const level = add(scaled(front, Math.cos(theta)), right, Math.sin(theta));
    const away = add(scaled(level, Math.sin(phi)), up, Math.cos(phi));
    return {
        position: add(target, away, radius),
        focalPoint: [...target],
        up: add(scaled(up, Math.sin(phi)), level, -Math.cos(phi)),
        viewAngle,
        orthographic: false,
    };
}

// The nearest orbit that cannot lose the model: the target stays inside its bounding sphere.
export function within(orbit, { centre, size, nearest }) {
    const offset = add(orbit.target, centre, -1);
    const distance = Math.hypot(...offset);
    return {
        ...orbit,
        phi: clamp(orbit.phi, 0, Math.PI),
        radius: clamp(orbit.radius, nearest, size * FARTHEST),
        target: distance > size ? add(centre, offset, size / distance) : orbit.target,
        viewAngle: clamp(orbit.viewAngle, 0.01, 3),
    };
}

// Whether the orbit is as near to its target as it may come (`factor` above 1) or as far from it as it may go (below 1).
export function isAtEnd({ radius }, factor, { size, nearest }) {
    return factor > 1 ? radius <= nearest * (1 + 1e-6) : radius >= size * FARTHEST * (1 - 1e-6);
}

// Moves the target parallel to the picture, which then moves by `right` and `down`, in picture heights.
export function panned(orbit, right, down, stage) {
    const { up, side } = axesOf(cameraOf(orbit, stage));
    const height = 2 * orbit.radius * Math.tan(orbit.viewAngle / 2);
    return { ...orbit, target: add(add(orbit.target, side, -right * height), up, down * height) };
}

// Brings the camera nearer to a point that it sees, by this factor. The point keeps its place in the picture, and the view
// turns about what lies as deep as it from then on. A point behind the eye changes nothing.
export function approached(orbit, point, factor, stage) {
    const { position, focalPoint } = cameraOf(orbit, stage);
    const forward = scaled(add(focalPoint, position, -1), 1 / orbit.radius);
    const depth = dot(add(point, position, -1), forward);
    if (depth <= 0) return orbit;
    const near = add(point, add(position, point, -1), 1 / factor);
    return { ...orbit, radius: depth / factor, target: add(near, forward, depth / factor) };
}

function axesOf({ position, focalPoint, up }) {
    const line = add(focalPoint, position, -1);
    const forward = scaled(line, 1 / Math.hypot(...line));
    const across = cross(forward, up);
    const side = scaled(across, 1 / Math.hypot(...across));
    return { forward, side, up: cross(side, forward) };
}

// Where a point of the model lies in a picture of width x height: {x, y} in pixels from the top left corner, and depth
// along the view, model units. At or behind the eye, depth is 0 or less and x, y mean nothing.
export function project(point, camera, width, height) {
    const { forward, side, up } = axesOf(camera);
    const offset = add(point, camera.position, -1);
    const depth = dot(offset, forward);
    const scale = height / 2 / Math.tan(camera.viewAngle / 2) / depth;
    return { x: width / 2 + dot(offset, side) * scale, y: height / 2 - dot(offset, up) * scale, depth };
}

// The point of the model at this place and depth of a picture.
export function unproject(x, y, depth, camera, width, height) {
    const { forward, side, up } = axesOf(camera);
    const scale = (depth * Math.tan(camera.viewAngle / 2)) / (height / 2);
    const ahead = add(camera.position, forward, depth);
    return add(add(ahead, side, (x - width / 2) * scale), up, (height / 2 - y) * scale);
}

// Whether a picture shows what lies at `point`, within `tolerance` (model units): false behind the model.
export function isVisible(point, normal, { camera, width, height, depths }, tolerance) {
    const { x, y, depth } = project(point, camera, width, height);
    if (depth <= 0 || x < 0 || y < 0 || x >= width || y >= height) return false;
    if (normal && dot(normal, add(camera.position, point, -1)) <= 0) return false;
    const pixel = (depth * Math.tan(camera.viewAngle / 2)) / (height / 2);
    // The farthest of the neighbours: a point at the border of the model is not hidden by a pixel in front of it.
    let farthest = 0;
    for (let row = Math.max(Math.floor(y) - 1, 0); row <= Math.min(Math.floor(y) + 1, height - 1); ++row)
        for (let column = Math.max(Math.floor(x) - 1, 0); column <= Math.min(Math.floor(x) + 1, width - 1); ++column)
            farthest = Math.max(farthest, depths[row * width + column]);
    return farthest >= depth - tolerance - 2 * pixel;
}

// "1.5cm" -> {value, unit}; null: there is no number, or one too large.
function parseQuantity(text) {
    const parts = /^([-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?)([a-z%]*)$/.exec(text.trim());
    return parts && Math.abs(parts[1]) < LARGEST ? { value: +parts[1], unit: parts[2] } : null;
}

// "30deg", "0.5rad", "auto" -> radians or null; throws a RangeError.
export function parseAngle(text) {
    if (text.trim() === "auto") return null;
    const { value, unit } = parseQuantity(text) ?? {};
    if (unit === "deg") return (value * Math.PI) / 180;
    if (unit === "rad" || (unit === "" && value === 0)) return value;
    throw new RangeError(`"${text}" is no angle: write 30deg, 0.5rad or auto`);
}

// "1.2", "1.2m", "105%" (of `whole`), "auto" -> model units or null. Throws a RangeError.
function parseLength(text, metre, whole) {
    if (text.trim() === "auto") return null;
    const { value, unit } = parseQuantity(text) ?? {};
    if (unit === "") return value;
    if (unit === "%") return (value / 100) * whole;
    if (["m", "cm", "mm"].includes(unit)) return value * METRES[unit] * metre;
    throw new RangeError(`"${text}" is no length: write 1.5, 1.5m, 20cm, 5mm, 105% or auto`);
}

// The distance from which a model is seen whole, whatever the direction: its bounding sphere touches the border of a
// picture that is `aspect` times as wide as high, if the target is its centre.
//   distance = size / sin(min(v, h) / 2), tan(h / 2) = aspect * tan(v / 2)
// `size`: radius of the sphere around the box lowest .. highest of the model; v, h: vertical and horizontal view angle.
export function wholeDistance(viewAngle, { size }, aspect) {
    return size / Math.sin(Math.atan(Math.min(aspect, 1) * Math.tan(viewAngle / 2)));
}

// What attributes say about an orbit, over `framed`, that of the default camera. Any of them may be null; if all are,
// the result is `framed` itself.
//   camera-orbit   "theta phi radius": the radius in % of wholeDistance(), which is its "auto", too
//   camera-target  "x y z", lengths; "auto": centre of the box lowest .. highest, as without camera-target
//   field-of-view  an angle: vertical
export function orbitFrom(framed, stage, aspect, cameraOrbit, cameraTarget, fieldOfView) {
    if (!cameraOrbit && !cameraTarget && !fieldOfView) return framed;
    const orbit = { ...framed };
    if (fieldOfView) {
        orbit.viewAngle = parseAngle(fieldOfView) ?? framed.viewAngle;
        if (!(orbit.viewAngle > 0 && orbit.viewAngle < Math.PI))
            throw new RangeError(`"${fieldOfView}" is no field of view: write more than 0 and less than 180deg`);
        // As much of the model as before.
        orbit.radius *= Math.sin(framed.viewAngle / 2) / Math.sin(orbit.viewAngle / 2);
    }
    if (cameraOrbit) {
        const parts = words(cameraOrbit);
        const whole = wholeDistance(orbit.viewAngle, stage, aspect);
        orbit.theta = parseAngle(parts[0]) ?? framed.theta;
        orbit.phi = parseAngle(parts[1]) ?? framed.phi;
        orbit.radius = parseLength(parts[2], stage.metre, whole) ?? whole;
        orbit.target = stage.centre;
    }
    if (cameraTarget) orbit.target = parsePoint(cameraTarget, stage.metre).map((value, i) => value ?? stage.centre[i]);
    return within(orbit, stage);
}

// "x y z", lengths -> three numbers, model units, or null where it says "auto". Throws a RangeError.
export function parsePoint(text, metre) {
    return words(text).map((part) => parseLength(part, metre, 0));
}

function words(text) {
    const parts = text.trim().split(/\s+/);
    if (parts.length !== 3) throw new RangeError(`"${text}" has ${parts.length} values: write three`);
    return parts;
}

// The view in words, for people who do not see it: "upper front left". `places`: see texts.js.
export function describe({ theta, phi }, places) {
    if (phi < Math.PI / 8) return places.top;
    if (phi > (Math.PI * 7) / 8) return places.bottom;
    const eighth = ((Math.round(theta / (Math.PI / 4)) % 8) + 8) % 8;
    const side = places.sides[eighth];
    if (phi < (Math.PI * 3) / 8) return filled(places.upper, { side });
    return phi > (Math.PI * 5) / 8 ? filled(places.lower, { side }) : side;
}
