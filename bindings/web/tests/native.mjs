// What the native programs say, to compare with.
//
//   PBM_WEB_PACKAGE  folder of the web package; default build/web/package
//   PBM_PROGRAMS     folder of pbm-render and pbm-validate; default build/release/bin
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, readdirSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import path from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";

export const SOURCE = fileURLToPath(new URL("../../..", import.meta.url));
const BIN = process.env.PBM_PROGRAMS ?? path.join(SOURCE, "build/release/bin");
const PACKAGE = process.env.PBM_WEB_PACKAGE ?? path.join(SOURCE, "build/web/package");

export const { loadPbm, loadValidator, CODES, ATTRIBUTES, PbmError } = await import(
    pathToFileURL(path.join(PACKAGE, "pbm.node.js")).href
);

/** Paths of the models in a folder of format_spec. */
export function modelsOf(folder) {
    const full = path.join(SOURCE, "format_spec", folder);
    return readdirSync(full, { recursive: true })
        .filter((name) => name.endsWith(".pbvg"))
        .sort()
        .map((name) => path.join(full, name));
}

export function bytesOf(file) {
    return new Uint8Array(readFileSync(file));
}

/** The picture of pbm-render: { pixels, depths } as those of Model.render. */
export function renderNatively(file, camera, width, height, options = []) {
    const folder = mkdtempSync(path.join(tmpdir(), "pbm-web-"));
    const picture = path.join(folder, "picture.bmp"),
        depths = path.join(folder, "depths.pfm");
    try {
        execFileSync(path.join(BIN, "pbm-render"), [
            "-q",
            "-o",
            picture,
            "--depth-output",
            depths,
            "--resolution",
            `${width},${height}`,
            `--camera-position=${camera.position}`,
            `--camera-focal-point=${camera.focalPoint}`,
            `--camera-view-up=${camera.up}`,
            ...options,
            file,
        ]);
        return {
            pixels: pixelsOf(readFileSync(picture), width, height),
            depths: depthsOf(readFileSync(depths), width, height),
        };
    } finally {
        rmSync(folder, { recursive: true });
    }
}

// BMP with 24 bits, or with 32 where pixels are transparent: rows padded to 4 bytes.
function pixelsOf(file, width, height) {
    const bytes = file.readUInt16LE(28) / 8,
        isTopFirst = file.readInt32LE(22) < 0,
        start = file.readUInt32LE(10);
    const stride = Math.ceil((bytes * width) / 4) * 4,
        pixels = new Uint8ClampedArray(4 * width * height);
    for (let y = 0; y < height; ++y)
        for (let x = 0; x < width; ++x) {
            const from = start + stride * (isTopFirst ? y : height - 1 - y) + bytes * x;
            pixels.set(
                [file[from + 2], file[from + 1], file[from], bytes === 4 ? file[from + 3] : 255],
                4 * (y * width + x),
            );
        }
    return pixels;
}

// PFM: three lines of text, then floats, the lowest row first.
function depthsOf(file, width, height) {
    const start = file.length - 4 * width * height,
        depths = new Float32Array(width * height);
    for (let y = 0; y < height; ++y)
        for (let x = 0; x < width; ++x)
            depths[y * width + x] = file.readFloatLE(start + 4 * ((height - 1 - y) * width + x));
    return depths;
}

/** What pbm-validate --json says of each of these files. */
export function validateNatively(files, options) {
    try {
        return JSON.parse(execFileSync(path.join(BIN, "pbm-validate"), ["--json", ...options, ...files])).files;
    } catch (failed) {
        // some are invalid
        return JSON.parse(failed.stdout).files;
    }
}

/** How many elements differ: assert would print them all. */
export function countDifferences(a, b) {
    if (a.length !== b.length) return Infinity;
    let count = 0;
    for (let i = 0; i < a.length; ++i) count += Object.is(a[i], b[i]) ? 0 : 1;
    return count;
}
