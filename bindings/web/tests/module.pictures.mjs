// Pictures and depths are those of pbm-render, to the byte, with and without threads.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import path from "node:path";
import { test } from "node:test";
import { ATTRIBUTES, bytesOf, countDifferences, loadPbm, modelsOf, renderNatively, SOURCE } from "./native.mjs";

const WIDTH = 161,
    HEIGHT = 90; // no multiple of a vector
const LIBRARIES = [await loadPbm({ threads: 0 }), await loadPbm({ threads: 3 })];

function assertSame(drawn, expected, what) {
    assert.equal(drawn.error, null, what);
    assert.equal(drawn.complete, true, what);
    assert.equal(countDifferences(drawn.pixels, expected.pixels), 0, `${what}: pixels differ`);
    assert.equal(countDifferences(drawn.depths, expected.depths), 0, `${what}: depths differ`);
}

test("the library is loaded with and without threads", () => {
    assert.deepEqual(
        LIBRARIES.map((pbm) => pbm.threads),
        [1, 3],
    );
    assert.equal(LIBRARIES[0].version, LIBRARIES[1].version);
});

const golden = modelsOf("golden");
test("there are golden models", () => assert.ok(golden.length >= 20));
for (const file of golden)
    test(`the pictures of ${path.relative(SOURCE, file)}`, () => {
        const bytes = bytesOf(file);
        for (const quality of ["fast", "fine"]) {
            let expected;
            for (const pbm of LIBRARIES) {
                const model = pbm.openBytes(bytes),
                    camera = model.defaultCamera(WIDTH, HEIGHT);
                expected ??= renderNatively(file, camera, WIDTH, HEIGHT, ["--quality", quality]);
                const drawn = model.render({ camera, width: WIDTH, height: HEIGHT, quality, depths: true });
                assertSame(drawn, expected, `${quality}, ${pbm.threads} threads`);
                model.close();
            }
            // A small fine picture may miss the few points of depth-16.pbvg: they are as small as in a large one.
            assert.ok(
                quality === "fine" || expected.depths.some((depth) => depth !== Infinity),
                "the picture shows something",
            );
        }
    });

const all = path.join(SOURCE, "format_spec/golden/1.0/scan-everything.pbvg");
const OPTIONS = [
    [{ without: ["texture"] }, ["--no-texture"]],
    [{ without: ["shadows", "ground"] }, ["--no-shadows", "--no-ground"]],
    [
        { without: ["panorama", "reflections", "colours"] },
        ["--no-panorama", "--no-reflections", "--ignore-point-colours"],
    ],
    [{ without: ["panorama"], background: [255, 0, 51, 255] }, ["--no-panorama", "--background-color", "1,0,0.2"]],
    [{ finestLevel: 3 }, ["--level", "3"]],
    [{ maxError: 9.5 }, ["--max-error", "9.5"]],
    [{ quality: "fine", samples: 3 }, ["--quality", "fine", "--samples", "3"]],
    [{ lightFollows: "eye" }, ["--light-follows", "eye"]],
    [{ lightFollows: "model" }, ["--light-follows", "model"]],
    [{ headlight: [-Math.PI / 4, Math.PI / 8] }, ["--headlight=-45,22.5"]],
    [{ depthCue: "eye-dome" }, ["--depth-cue", "eye-dome"]],
    [{ depthCue: "ambient-occlusion" }, ["--depth-cue", "ambient-occlusion"]],
];
const fields = path.join(SOURCE, "format_spec/golden/1.1/scan-fields.pbvg");
const OF_FIELDS = [
    [{ colourBy: "intensity" }, ["--colour-by=intensity"]],
    [{ colourBy: "classification", quality: "fine" }, ["--colour-by=classification", "--quality", "fine"]],
    [{ dropClass: "ground" }, ["--drop-class=ground"]],
    [{ showClass: "ground,5", colourBy: "class" }, ["--show-class=ground,5", "--colour-by=class"]],
    [
        { colourBy: "height", colourRange: [-1, 0.5], colourMap: "grey", without: ["legend"] },
        ["--colour-by=height,-1,0.5,grey", "--no-legend"],
    ],
];
for (const [file, options, native] of [
    ...OPTIONS.map((each) => [all, ...each]),
    ...OF_FIELDS.map((each) => [fields, ...each]),
])
    test(`the picture with ${native.join(" ")}`, () => {
        const model = LIBRARIES[0].openBytes(bytesOf(file)),
            camera = model.defaultCamera(WIDTH, HEIGHT);
        const words = native.includes("--quality") ? native : ["--quality", "fast", ...native];
        assertSame(
            model.render({ camera, width: WIDTH, height: HEIGHT, depths: true, ...options }),
            renderNatively(file, camera, WIDTH, HEIGHT, words),
            native.join(" "),
        );
        model.close();
    });

test("cameras that cut and that are orthographic", () => {
    const model = LIBRARIES[0].openBytes(bytesOf(all)),
        camera = model.defaultCamera(WIDTH, HEIGHT);
    const { lowest, highest } = model.info(),
        middle = lowest.map((low, axis) => (low + highest[axis]) / 2);
    const cameras = [
        [{ orthographic: true }, ["--projection", "orthographic"]],
        [{ clipPlane: { point: middle, normal: [1, 0, 0] } }, [`--clip-plane=${middle},1,0,0`]],
        [{ clipBox: { lowest, highest: middle } }, [`--clip-box=${lowest},${middle}`]],
    ];
    for (const [changes, native] of cameras)
        assertSame(
            model.render({ camera: { ...camera, ...changes }, width: WIDTH, height: HEIGHT, depths: true }),
            renderNatively(all, camera, WIDTH, HEIGHT, ["--quality", "fast", ...native]),
            native.join(" "),
        );
    model.close();
});

// From behind: lights that stay where they are in the first view leave this side dark.
for (const [name, changes, options, native] of [
    ["1.0/scan-plain", { backs: "hide" }, {}, ["--backs", "hide"]],
    ["1.2/scan-closed", { backs: "show" }, {}, ["--backs", "show"]],
    ["1.0/scan-plain", {}, { lightFollows: "model" }, ["--light-follows", "model"]],
])
    for (const quality of ["fast", "fine"])
        test(`the ${quality} picture of ${name} with ${native.join(" ")} from behind`, () => {
            const file = path.join(SOURCE, `format_spec/golden/${name}.pbvg`),
                bytes = bytesOf(file);
            for (const pbm of LIBRARIES) {
                const model = pbm.openBytes(bytes),
                    first = model.defaultCamera(WIDTH, HEIGHT);
                const position = first.focalPoint.map((middle, axis) => 2 * middle - first.position[axis]),
                    camera = { ...first, position, ...changes };
                const draw = (more) => model.render({ width: WIDTH, height: HEIGHT, quality, depths: true, ...more }),
                    usual = draw({ camera: { ...camera, backs: "auto" } }).pixels.slice();
                const drawn = draw({ camera, ...options });
                assert.notEqual(countDifferences(drawn.pixels, usual), 0, "the option changes nothing");
                assertSame(
                    drawn,
                    renderNatively(file, camera, WIDTH, HEIGHT, ["--quality", quality, ...native]),
                    `${pbm.threads} threads`,
                );
                model.close();
            }
        });

test("a model says whether its surface is closed", () => {
    for (const file of golden) {
        const { files } = JSON.parse(readFileSync(path.join(path.dirname(file), "contents.json"), "utf8"));
        const expected = files.find((entry) => entry.file === path.basename(file)).closed === true;
        const model = LIBRARIES[0].openBytes(bytesOf(file));
        const isClosed = (model.info().attributes & ATTRIBUTES.CLOSED) !== 0;
        assert.equal(isClosed, expected, file);
        model.close();
    }
});

for (const pbm of LIBRARIES) {
    test(`several models in one memory, drawn in turn, ${pbm.threads} thread(s)`, () => drawInTurn(pbm));
}

function drawInTurn(pbm) {
    const models = golden.slice(0, 4).map((path) => pbm.openBytes(bytesOf(path)));
    const draw = (model) => model.render({ camera: model.defaultCamera(64, 48), width: 64, height: 48 }).pixels.slice();
    const first = models.map(draw),
        second = models.map(draw);
    assert.deepEqual(first, second);
    assert.notDeepEqual(first[0], first[1]);
    models.forEach((model) => model.close());
}
