// Bytes that arrive piece by piece: pictures become finer, and the last one is that of the whole file.
import assert from "node:assert/strict";
import path from "node:path";
import { test } from "node:test";
import { bytesOf, CODES, countDifferences, loadPbm, modelsOf, PbmError, SOURCE } from "./native.mjs";

const LIBRARIES = [await loadPbm({ threads: 0 }), await loadPbm({ threads: 3 })];
const [pbm] = LIBRARIES;
const WIDTH = 200,
    HEIGHT = 150;

function pictureOf(model, camera, more = {}) {
    const picture = model.render({ camera, width: WIDTH, height: HEIGHT, depths: true, ...more });
    return { ...picture, pixels: picture.pixels.slice(), depths: picture.depths.slice() };
}

function exactPicture(bytes) {
    const model = pbm.openBytes(bytes),
        camera = model.defaultCamera(WIDTH, HEIGHT),
        info = model.info();
    const picture = pictureOf(model, camera);
    model.close();
    return { camera, info, picture };
}

function streamInPieces(library, file) {
    const bytes = bytesOf(file),
        exact = exactPicture(bytes),
        piece = Math.ceil(bytes.length / 40);
    let arrived = 0,
        pictures = 0,
        model = null,
        drawn = null;
    const asked = [];
    const read = (offset, size) => {
        assert.ok(size > 0 && offset + size <= bytes.length);
        if (offset + size <= arrived) return bytes.subarray(offset, offset + size);
        asked.push(offset);
        return null;
    };
    for (; !drawn?.complete; arrived += piece) {
        assert.ok(arrived < bytes.length + piece, "all bytes are there, and the picture is not complete");
        asked.length = 0;
        model ??= library.open({ size: bytes.length, read });
        const info = model?.info() ?? null,
            camera = model?.defaultCamera(WIDTH, HEIGHT) ?? null;
        assert.equal(info === null, camera === null);
        if (info === null) {
            assert.ok(asked.length > 0, "what is missing is asked for");
            if (model !== null)
                // a camera of one's own needs no points
                assert.equal(pictureOf(model, exact.camera).error, null);
            continue;
        }
        assert.deepEqual({ info, camera }, { info: exact.info, camera: exact.camera });
        drawn = pictureOf(model, camera);
        assert.equal(drawn.error, null);
        assert.equal(drawn.complete, asked.length === 0);
        ++pictures;
    }
    assert.ok(pictures > 0);
    assert.equal(countDifferences(drawn.pixels, exact.picture.pixels), 0);
    assert.equal(countDifferences(drawn.depths, exact.picture.depths), 0);
    model.close();
}

for (const library of LIBRARIES)
    for (const file of modelsOf("golden"))
        test(`a stream of ${path.relative(SOURCE, file)}, ${library.threads} thread(s)`, () => streamInPieces(library, file));

test("only the ranges that are asked for are fetched, and each chunk once", () => {
    const bytes = bytesOf(path.join(SOURCE, "format_spec/golden/1.0/scan-everything.pbvg")),
        exact = exactPicture(bytes);
    const fetched = new Map();
    let wanted = [],
        rounds = 0,
        given = 0;
    const read = (offset, size) => {
        const key = `${offset}+${size}`;
        if (fetched.has(key)) {
            given += 1;
            return bytes.subarray(offset, offset + size);
        }
        wanted.push(key);
        return null;
    };
    let model = null,
        picture = null;
    for (; !picture?.complete; ++rounds) {
        assert.ok(rounds < 20);
        wanted.forEach((key) => fetched.set(key, true));
        wanted = [];
        model ??= pbm.open({ size: bytes.length, read });
        const camera = model?.defaultCamera(WIDTH, HEIGHT);
        if (camera) picture = pictureOf(model, camera);
    }
    assert.equal(countDifferences(picture.pixels, exact.picture.pixels), 0);
    const before = given;
    assert.equal(pictureOf(model, exact.camera).complete, true);
    assert.equal(given, before, "what is resident is not read again");
    model.close();
});

test("the first picture is coarse, and comes long before the last byte", () => {
    const bytes = bytesOf(path.join(SOURCE, "format_spec/golden/1.0/scan-plain.pbvg")),
        exact = exactPicture(bytes);
    const seen = ({ depths }) => depths.filter((depth) => depth !== Infinity).length;
    let arrived = 0,
        model = null,
        picture = null;
    const read = (offset, size) => (offset + size <= arrived ? bytes.subarray(offset, offset + size) : null);
    for (; picture === null || seen(picture) < 0.9 * seen(exact.picture); arrived += 256) {
        model ??= pbm.open({ size: bytes.length, read });
        picture = model === null ? null : pictureOf(model, exact.camera);
    }
    assert.ok(arrived < bytes.length / 2, `${arrived} of ${bytes.length} bytes`);
    assert.equal(picture.complete, false);
    assert.notDeepEqual(picture.pixels, exact.picture.pixels);
    model.close();
});

test("what the callback throws is thrown, and the model goes on", () => {
    const bytes = bytesOf(path.join(SOURCE, "format_spec/golden/1.0/scan-plain.pbvg")),
        exact = exactPicture(bytes);
    const lost = new Error("the network is gone");
    let answer = () => {
        throw lost;
    };
    const source = { size: bytes.length, read: (offset, size) => answer(offset, size) };
    assert.throws(
        () => pbm.open(source),
        (error) => error === lost,
    );
    const whole = (offset, size) => bytes.subarray(offset, offset + size);
    answer = whole;
    const model = pbm.open(source);
    answer = () => {
        throw lost;
    };
    assert.throws(
        () => model.info(),
        (error) => error === lost,
    );
    assert.throws(
        () => pictureOf(model, exact.camera),
        (error) => error === lost,
    );
    for (const wrong of [new Uint8Array(1), "text", undefined, bytes.buffer]) {
        answer = () => wrong;
        assert.throws(
            () => model.info(),
            (error) => error instanceof PbmError && error.code === CODES.USAGE,
        );
    }
    answer = whole;
    assert.equal(countDifferences(pictureOf(model, exact.camera).pixels, exact.picture.pixels), 0);
    model.close();
});
