// The view of the viewer: orbits, projections, attributes, motion, and credits.
import assert from "node:assert/strict";
import { describe, test } from "node:test";
import { creditsOf, linked } from "../viewer/credit.js";
import { exposed } from "../viewer/exposure.js";
import { colouringOf, exposureOf, headlightOf } from "../viewer/look.js";
import { Motion } from "../viewer/motion.js";
import { TEXTS } from "../viewer/texts.js";
import * as orbits from "../viewer/orbit.js";

const infoOf = (up, unit = "m") => ({ up, unit, lowest: [-1, -1, -1], highest: [1, 1, 1], voxelSize: 1e-4 });
const near = (a, b, tolerance = 1e-9) => {
    assert.equal(a.length, b.length);
    for (const [i, x] of a.entries()) assert.ok(Math.abs(x - b[i]) <= tolerance, `${a} is not near ${b}`);
};
const ORBIT = { theta: 0.3, phi: 1.2, radius: 5, target: [0.1, 0.2, 0.3], viewAngle: 0.5 };

describe("look", () => {
    test("colours of a field are read as pbm-render --colour-by", () => {
        assert.deepEqual(colouringOf(null), { colourBy: "" });
        assert.deepEqual(colouringOf("a,b"), { colourBy: "a,b" });
        assert.deepEqual(colouringOf("class,classes"), { colourBy: "class", colourMap: "classes" });
        const whole = { colourBy: "a,b", colourRange: [-1.5, 2], colourMap: "grey" };
        assert.deepEqual(colouringOf("a,b,-1.5,2,grey"), whole);
    });
    test("a headlight is two angles", () => {
        near(headlightOf(" -45deg  0.5rad"), [-Math.PI / 4, 0.5]);
        for (const text of [null, "", "30deg", "auto 0", "1 2", "181deg 0", "0 91deg", "0 0 0"])
            assert.equal(headlightOf(text), null, text);
    });
});

describe("exposure", () => {
    const red = [255, 0, 0, 255];
    test("no stops leave colours as they are, and one doubles their light", () => {
        const ramp = Uint8Array.from({ length: 1024 }, (_, i) => (i % 4 === 3 ? 255 : i >> 2));
        assert.deepEqual([...exposed(ramp, 0, red)], [...ramp]);
        // 188 is half of white in linear light, 137 a quarter.
        assert.deepEqual([...exposed([137, 188, 189, 255], 1, red)], [188, 255, 255, 255]);
        assert.deepEqual([...exposed([255, 188, 0, 255], -1, red)], [188, 137, 0, 255]);
    });
    test("the background keeps its colour", () => {
        assert.deepEqual([...exposed([0, 0, 0, 0], 3, red)], red);
        assert.deepEqual([...exposed([9, 9, 9, 0], 3, [0, 0, 0, 0])].slice(3), [0]);
        // Half of a white pixel, behind it black: half of the light.
        assert.deepEqual([...exposed([137, 137, 137, 128], 2, [0, 0, 0, 255])], [188, 188, 188, 255]);
        assert.deepEqual([...exposed([137, 137, 137, 128], 2, [0, 0, 0, 0])], [255, 255, 255, 128]);
    });
    test("what is no number of stops is none", () => {
        const element = (text) => ({ getAttribute: () => text });
        assert.equal(exposureOf(element(null)), 0);
        assert.equal(exposureOf(element(" -1.5 ")), -1.5);
        const warn = console.warn;
        const warnings = [];
        console.warn = (text) => warnings.push(text);
        for (const text of ["bright", "11", "1ev", "Infinity"]) assert.equal(exposureOf(element(text)), 0, text);
        console.warn = warn;
        assert.equal(warnings.length, 4);
    });
});

describe("orbit", () => {
    for (const up of ["+x", "+y", "+z"]) {
        test(`cameras and orbits are the same thing, ${up} up`, () => {
            const stage = orbits.stageOf(infoOf(up));
            const again = orbits.orbitOf(orbits.cameraOf(ORBIT, stage), stage);
            near([again.theta, again.phi, again.radius, ...again.target], [0.3, 1.2, 5, 0.1, 0.2, 0.3]);
        });
    }
    test("theta turns to the right of the model, phi leads down from the top", () => {
        const stage = orbits.stageOf(infoOf("+y"));
        const at = (theta, phi) => orbits.cameraOf({ ...ORBIT, target: [0, 0, 0], radius: 1, theta, phi }, stage);
        near(at(0, Math.PI / 2).position, [0, 0, 1]);
        near(at(Math.PI / 2, Math.PI / 2).position, [1, 0, 0]);
        near(at(0, 0).position, [0, 1, 0]);
        near(at(0, 0).up, [0, 0, -1]);
        near(at(0, Math.PI / 2).up, [0, 1, 0]);
    });
    test("a point that is zoomed at keeps its place, and is never reached", () => {
        const stage = orbits.stageOf(infoOf("+y"));
        const point = [0.4, 0.5, 0.2];
        const seen = (orbit) => orbits.project(point, orbits.cameraOf(orbit, stage), 640, 480);
        const first = seen(ORBIT);
        let orbit = ORBIT;
        for (let i = 1; i <= 60; ++i) {
            orbit = orbits.approached(orbit, point, 1.3, stage);
            const { x, y, depth } = seen(orbit);
            near([x, y], [first.x, first.y], 1e-6);
            near([depth, orbit.radius], [first.depth / 1.3 ** i, depth], 1e-9);
        }
        const behind = [10, 10, 10];
        assert.equal(orbits.approached(ORBIT, behind, 2, stage), ORBIT);
    });
    test("a Z-up model is seen from -Y", () => {
        const camera = orbits.cameraOf(
            { ...ORBIT, theta: 0, phi: Math.PI / 2, target: [0, 0, 0] },
            orbits.stageOf(infoOf("+z")),
        );
        near(camera.position, [0, -5, 0]);
    });
    test("a drag to the right moves what is in the plane of the target by as many pixels", () => {
        const stage = orbits.stageOf(infoOf("+y"));
        const point = [0.1, 0.2, 0.3];
        const before = orbits.project(point, orbits.cameraOf(ORBIT, stage), 400, 300);
        near([before.x, before.y], [200, 150]);
        const after = orbits.project(point, orbits.cameraOf(orbits.panned(ORBIT, 0.1, 0.2, stage), stage), 400, 300);
        near([after.x, after.y], [230, 210]);
    });
    test("places in the picture lead back to the point", () => {
        const camera = orbits.cameraOf(ORBIT, orbits.stageOf(infoOf("+z")));
        const { x, y, depth } = orbits.project([0.5, -0.4, 0.2], camera, 640, 480);
        near(orbits.unproject(x, y, depth, camera, 640, 480), [0.5, -0.4, 0.2]);
    });
    test("points behind the surface are hidden, and those that face away", () => {
        const stage = orbits.stageOf(infoOf("+y"));
        const camera = orbits.cameraOf({ ...ORBIT, theta: 0, phi: Math.PI / 2, target: [0, 0, 0] }, stage);
        const picture = { camera, width: 9, height: 9, depths: new Float32Array(81).fill(4) };
        const isVisible = (point, normal = null) => orbits.isVisible(point, normal, picture, 0.01);
        assert.equal(isVisible([0, 0, 1]), true);
        assert.equal(isVisible([0, 0, -1]), false);
        assert.equal(isVisible([0, 0, 1], [0, 0, 1]), true);
        assert.equal(isVisible([0, 0, 1], [0, 0, -1]), false);
        assert.equal(isVisible([9, 0, 0]), false);
        assert.equal(isVisible([0, 0, 9]), false);
        picture.depths.fill(Infinity);
        assert.equal(isVisible([0, 0, -1]), true);
    });
});

describe("attributes", () => {
    const stage = orbits.stageOf(infoOf("+y", "cm"));
    const framed = { theta: 0, phi: Math.PI / 2, radius: 10, target: [0.2, 0, 0], viewAngle: 0.5 };
    const orbitFrom = (...given) => orbits.orbitFrom(framed, stage, 1.5, ...given);
    test("nothing given is the framed view itself", () => {
        assert.equal(orbitFrom(null, null, null), framed);
    });
    test("angles, percent, units and auto", () => {
        const half = Math.sqrt(3) / Math.sin(0.25) / 2;
        const orbit = orbitFrom("90deg 1rad 50%", "0.5 auto 1mm", null);
        near([orbit.theta, orbit.phi, orbit.radius, ...orbit.target], [Math.PI / 2, 1, half, 0.5, 0, 0.1]);
        const metric = orbitFrom("auto auto 0.03m", null, null);
        near([metric.theta, metric.phi, metric.radius, ...metric.target], [0, Math.PI / 2, 3, 0, 0, 0]);
    });
    test("100% shows the whole model from every direction, and as large as that allows", () => {
        for (const aspect of [0.3, 1, 2.5])
            for (const fieldOfView of [null, "70deg"]) {
                let farthest = 0; // from the middle, in half widths or heights
                for (let theta = 0; theta < 360; theta += 5)
                    for (let phi = 0; phi <= 180; phi += 5) {
                        const text = `${theta}deg ${phi}deg ${theta % 2 ? "auto" : "100%"}`;
                        const orbit = orbits.orbitFrom(framed, stage, aspect, text, null, fieldOfView);
                        const camera = orbits.cameraOf(orbit, stage);
                        for (let corner = 0; corner < 8; ++corner) {
                            const point = [corner & 1, corner & 2, corner & 4].map((bit) => (bit ? 1 : -1));
                            const { x, y } = orbits.project(point, camera, 2 * aspect, 2);
                            farthest = Math.max(farthest, Math.abs(x / aspect - 1), Math.abs(y - 1));
                        }
                    }
                assert.ok(farthest < 1 && farthest > 0.8, `${farthest} at ${aspect}, ${fieldOfView}`);
            }
    });
    test("a narrower view stands farther away", () => {
        const { radius, viewAngle } = orbitFrom(null, null, "10deg");
        near([viewAngle, radius * Math.sin(viewAngle / 2)], [Math.PI / 18, 10 * Math.sin(0.25)]);
    });
    for (const [orbit, target, fieldOfView = null] of [
        ["30 auto auto", null],
        ["auto auto", null],
        ["auto auto 3px", null],
        [null, "1 2"],
        ["0px auto auto", null],
        ["1e999deg auto auto", null],
        [".deg auto auto", null],
        ["1.2.3deg auto auto", null],
        ["auto auto 1e999%", null],
        ["auto auto .", null],
        ["auto auto 1deg", null],
        [null, "0 -1e999m 0"],
        [null, null, "abc"],
        [null, null, ".deg"],
        [null, null, "1e999deg"],
        [null, null, "0"],
        [null, null, "-30deg"],
        [null, null, "180deg"],
    ]) {
        test(`${orbit ?? target ?? fieldOfView} is refused with advice`, () => {
            assert.throws(() => orbitFrom(orbit, target, fieldOfView), /write/);
        });
    }
    test("numbers of any size lead to finite cameras", () => {
        for (const number of ["1e99", "-1e99", "1e-320", ".5", "5."]) {
            const orbit = orbitFrom(`${number}deg ${number}rad ${number}%`, `${number} ${number}mm ${number}m`, null);
            const { position, up } = orbits.cameraOf(orbit, stage);
            assert.ok([...position, ...up].every(Number.isFinite), number);
        }
    });
    test("the model cannot be lost", () => {
        const orbit = orbitFrom("0 -3rad 1e9", "100 0 0", null);
        near([orbit.phi, orbit.radius, ...orbit.target], [0, 50 * Math.sqrt(3), Math.sqrt(3), 0, 0]);
    });
});

describe("motion", () => {
    const stage = orbits.stageOf(infoOf("+y"));
    const framed = { theta: 0, phi: Math.PI / 2, radius: 10, target: [0, 0, 0], viewAngle: 0.5 };
    test("a drag is shown at once, a key glides to its goal and ends there", () => {
        const motion = new Motion(stage, framed, 2, () => false);
        assert.equal(motion.step(16), false);
        motion.turn(0.1, 0, false);
        assert.equal(motion.orbit, motion.goal);
        assert.equal(motion.step(16), true);
        assert.equal(motion.step(16), false);
        motion.zoom(2, true);
        let steps = 0;
        for (; motion.step(16); ++steps) assert.ok(motion.orbit.radius <= 10 && motion.orbit.radius >= 5);
        assert.ok(steps > 5);
        assert.equal(motion.orbit, motion.goal);
        assert.equal(motion.orbit.radius, 5);
    });
    test("for users who want no motion there is none", () => {
        const motion = new Motion(stage, framed, 2, () => true);
        motion.zoom(2, true);
        assert.equal(motion.orbit.radius, 5);
    });
    test("the default view stays the exact one in another shape of the picture", () => {
        const motion = new Motion(stage, framed, 2, () => false);
        const wide = { ...framed, radius: 8 };
        motion.reframe(wide, 3);
        assert.equal(motion.orbit, wide);
        motion.zoom(2, false);
        assert.equal(motion.orbit.radius, 4);
        motion.reframe(framed, 1.5);
        assert.equal(motion.orbit.radius, 4);
        motion.reframe(framed, 0.5);
        near([Math.tan(Math.asin((4 * Math.sin(0.25)) / motion.orbit.radius))], [Math.tan(0.25) / 2]);
    });
    test("descriptions", () => {
        const of = (theta, phi, { places } = TEXTS.en) =>
            orbits.describe({ theta: (theta * Math.PI) / 180, phi: (phi * Math.PI) / 180 }, places);
        assert.deepEqual([of(50, 45, TEXTS.de), of(180, 178, TEXTS.de)], ["vorn rechts oben", "unten"]);
        assert.deepEqual(
            [of(0, 90), of(50, 45), of(-90, 120), of(180, 90), of(720, 5), of(3, 178)],
            ["front", "upper front right", "lower left", "back", "top", "bottom"],
        );
    });
});

describe("credits", () => {
    test("name, credit and licence are shown, and nothing else", () => {
        assert.deepEqual(
            creditsOf('{"generator":"x","name":"Lucy","credit":" A\\u0000\\u202eB ","licence":"","options":{}}'),
            ["Lucy", "A B"],
        );
        assert.deepEqual(creditsOf('{"name":7}'), []);
        assert.deepEqual(creditsOf("{"), []);
        assert.deepEqual(creditsOf("null"), []);
    });
    test("links lead to http and https alone", () => {
        assert.deepEqual(linked("Smith <https://example.org/a>, 2020"), [
            { text: "Smith", href: "https://example.org/a" },
            { text: ", 2020" },
        ]);
        assert.deepEqual(linked("CC-BY-4.0 https://creativecommons.org/licenses/by/4.0/."), [
            { text: "CC-BY-4.0" },
            { text: "creativecommons.org", href: "https://creativecommons.org/licenses/by/4.0/" },
            { text: "." },
        ]);
        for (const href of ["https://paypal.com@evil.example/", "https://paypal.com:x@evil.example"])
            assert.deepEqual(linked(`see ${href}`), [{ text: "see" }, { text: "evil.example", href }]);
        assert.deepEqual(linked("a https://[ b"), [{ text: "a https://[ b" }]);
        const text = "javascript:alert(1) <javascript:alert(1)> <script>x</script>";
        assert.deepEqual(linked(text), [{ text }]);
    });
});
