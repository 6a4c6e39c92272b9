// Damaged bytes: what is proven is shown, the rest is named. Wrong calls are refused.
import assert from "node:assert/strict";
import path from "node:path";
import { test } from "node:test";
import { bytesOf, CODES, loadPbm, loadValidator, modelsOf, PbmError, SOURCE } from "./native.mjs";

const pbm = await loadPbm({ threads: 0 });
const validator = await loadValidator();
const file = path.join(SOURCE, "format_spec/golden/1.0/scan-plain.pbvg");
const SIZE = { width: 200, height: 150 };

const isUsage = (error) => error instanceof PbmError && error.code === CODES.USAGE && error.message !== "";

test("a flipped byte of a chunk is named, and the rest is drawn", () => {
    const whole = bytesOf(file),
        model = pbm.openBytes(whole),
        camera = model.defaultCamera(200, 150);
    const seen = ({ depths }) => depths.filter((depth) => depth !== Infinity).length;
    const exact = seen(model.render({ camera, ...SIZE, depths: true }));
    model.close();
    let damaged = 0;
    for (let at = (whole.length / 2) | 0; at < whole.length; at += 997) {
        const bytes = whole.slice();
        bytes[at] ^= 1;
        const { findings } = validator.validate(bytes);
        const broken = pbm.openBytes(bytes);
        for (let again = 0; again < 2; ++again) {
            const picture = broken.render({ camera, ...SIZE, depths: true });
            assert.equal(picture.complete, picture.error === null);
            assert.ok(Math.abs(seen(picture) / exact - 1) < 0.2);
            if (picture.error === null) continue; // of what the picture does not show
            ++damaged;
            assert.equal(picture.error.code, CODES.INVALID);
            const found = findings.find(
                ({ name, offset }) => name === picture.error.name && offset === picture.error.offset,
            );
            assert.ok(found, `${at}: ${picture.error.name} at ${picture.error.offset}`);
            assert.equal(picture.error.rule, found.rule);
        }
        broken.close();
    }
    assert.ok(damaged >= 4 && damaged % 2 === 0);
});

test("files that are none, and files that are cut short", () => {
    const whole = bytesOf(file);
    const isInvalid = (error) => error instanceof PbmError && error.code === CODES.INVALID && error.name !== "";
    assert.throws(() => pbm.openBytes(new Uint8Array(0)), isInvalid);
    assert.throws(() => pbm.openBytes(new Uint8Array(1000)), isInvalid);
    for (let size = 0; size < whole.length; size += (1 + size / 2) | 0)
        assert.throws(() => pbm.openBytes(whole.subarray(0, size)), isInvalid);
});

test("invalid files of the law neither crash nor hang", () => {
    for (const vector of modelsOf("vectors/invalid"))
        try {
            const model = pbm.openBytes(bytesOf(vector));
            const camera = model.defaultCamera(40, 30);
            model.render({ camera, width: 40, height: 30 });
            model.close();
        } catch (error) {
            assert.ok(error instanceof PbmError && error.code !== CODES.USAGE, `${vector}: ${error}`);
        }
    assert.equal(pbm.openBytes(bytesOf(file)).info().depth > 0, true);
});

test("wrong calls are refused", () => {
    assert.throws(() => pbm.openBytes("text"), isUsage);
    assert.throws(() => pbm.openBytes(null), isUsage);
    for (const source of [undefined, null, 5, "text"]) assert.throws(() => pbm.open(source), isUsage);
    for (const source of [{ size: -1, read() {} }, { size: 1.5, read() {} }, { size: 10 }, { size: NaN, read() {} }])
        assert.throws(() => pbm.open(source), isUsage);
    const model = pbm.openBytes(bytesOf(file)),
        camera = model.defaultCamera(200, 150);
    for (const options of [
        { ...SIZE },
        { camera, width: 0, height: 10 },
        { camera, width: 10 },
        undefined,
        null,
        5,
        { camera, width: 1e9, height: 1 },
        { camera, width: 10.5, height: 10 },
        { camera, width: "10", height: 10 },
        { camera: 5, ...SIZE },
        { camera, ...SIZE, without: 5 },
        { camera, ...SIZE, without: "texture" },
        { camera, ...SIZE, background: 5 },
        { camera, ...SIZE, background: ["red", 0, 0, 0] },
        { camera, ...SIZE, samples: 1.5 },
        { camera, ...SIZE, finestLevel: 2 ** 31 },
        { camera, ...SIZE, maxError: "1" },
        { camera: { ...camera, position: ["1", 0, 0] }, ...SIZE },
        { camera, ...SIZE, quality: "best" },
        { camera, ...SIZE, without: ["sky"] },
        { camera, ...SIZE, samples: 257 },
        { camera, ...SIZE, depthCue: "all" },
        { camera, ...SIZE, lightFollows: "sun" },
        { camera, ...SIZE, headlight: [4, 0] },
        { camera, ...SIZE, headlight: 1 },
        { camera, ...SIZE, colourBy: "nothing" },
        { camera, ...SIZE, colourBy: "nothing", colourRange: [1, 0] },
        { camera, ...SIZE, colourMap: "rainbow" },
        { camera: { ...camera, backs: "none" }, ...SIZE },
        { camera: { ...camera, backs: 1 }, ...SIZE },
        { camera, ...SIZE, maxError: -1 },
        { camera, ...SIZE, finestLevel: 99 },
        { camera: { ...camera, up: [0, 0, 0] }, ...SIZE },
        { camera: { ...camera, position: camera.focalPoint }, ...SIZE },
        { camera: { ...camera, position: [NaN, 0, 0] }, ...SIZE },
        { camera: { ...camera, viewAngle: 4 }, ...SIZE },
        { camera: { ...camera, up: [1, 2] }, ...SIZE },
    ])
        assert.throws(() => model.render(options), isUsage, JSON.stringify(options));
    for (const maxMemory of [Infinity, NaN, -1, 0.5, 1e300, "1", 1n])
        assert.throws(
            () => model.render({ camera, ...SIZE, maxMemory }),
            (error) => isUsage(error) && /^maxMemory/.test(error.message),
        );
    for (const maxFindings of [Infinity, NaN, -1, 0.5, "1"])
        assert.throws(
            () => validator.validate(new Uint8Array(1), { maxFindings }),
            (error) => isUsage(error) && /^maxFindings/.test(error.message),
        );
    for (const size of [0, -1, 40000, 1.5, NaN, undefined]) assert.throws(() => model.defaultCamera(size, 10), isUsage);
    model.close();
    model.close();
    for (const call of [() => model.info(), () => model.defaultCamera(10, 10), () => model.render({ camera, ...SIZE })])
        assert.throws(call, isUsage);
});

test("pictures that need more memory than there is are refused, and the next ones are right", () => {
    const isLimit = (error) => error instanceof PbmError && error.code === CODES.LIMIT && error.name !== "";
    const bytes = bytesOf(file),
        model = pbm.openBytes(bytes),
        camera = model.defaultCamera(200, 150);
    const picture = () => model.render({ camera, ...SIZE }).pixels.slice();
    const exact = picture();
    for (let again = 0; again < 2; ++again)
        // 8 * 2^30 bytes, 4 * 2^30 bytes, and 3.2e9 of them: more than 2^32, exactly as many, and fewer
        for (const [edge, depths] of [
            [32768, true],
            [32768, false],
            [20000, true],
        ]) {
            assert.throws(() => model.render({ camera, width: edge, height: edge, depths }), isLimit);
            const others = Array.from({ length: 6 }, () => pbm.openBytes(bytes));
            for (const other of [...others, model])
                assert.deepEqual(other.render({ camera, ...SIZE }).pixels.slice(), exact);
            others.forEach((other) => other.close());
            assert.deepEqual(picture(), exact);
        }
    model.close();
    assert.throws(() => validator.validate(new Uint8Array(2 ** 32)), isLimit); // which takes no memory: it is zero
    assert.equal(validator.validate(bytes).verdict, 0);
});

test("loading is refused where it cannot work", async () => {
    await assert.rejects(loadPbm({ threads: -1 }), isUsage);
    await assert.rejects(loadPbm({ threads: "many" }), isUsage);
    const isMissing = (error) => error instanceof PbmError && error.code === CODES.IO;
    for (const base of ["file:///nowhere/", "nowhere"]) {
        await assert.rejects(loadPbm({ base }), isMissing);
        await assert.rejects(loadValidator({ base }), isMissing);
    }
});

test("memory is bounded", () => {
    const bytes = bytesOf(path.join(SOURCE, "format_spec/golden/1.0/scan-plain.pbvg"));
    const model = pbm.openBytes(bytes),
        camera = model.defaultCamera(600, 600),
        size = { width: 600, height: 600 };
    const exact = model.render({ camera, ...size }).pixels.slice();
    const limited = model.render({ camera, ...size, maxMemory: 30000, depths: true });
    assert.equal(limited.error.code, CODES.LIMIT);
    assert.equal(limited.complete, false);
    assert.ok(limited.depths.some((depth) => depth !== Infinity));
    assert.equal(model.render({ camera, ...size, maxMemory: 30000, maxError: 60 }).error, null);
    assert.deepEqual(model.render({ camera, ...size }).pixels, exact);
    model.close();
});
