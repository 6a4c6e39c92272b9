// How fast the web module is in node, beside the native program: measure.mjs MODEL.pbvg [PBM_RENDER]
//
//   sizes    bytes of each module, and compressed by gzip -9
//   decode   all levels of the model with all checks, one thread, warm, processor time
//   frames   1280x720 round the focal point, one thread (processor time) and two; PBM_RENDER draws the same for comparison. Its vectors should be
//            as wide: configure it with -DPBM_SIMD_TARGETS=HWY_SSE4
//   stream   bytes of the file, in its order, that the first picture and the exact picture need
//
// Needs the target pbm_bench of the preset web.
import { execFileSync } from "node:child_process";
import { readdirSync, readFileSync } from "node:fs";
import path from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";
import { gzipSync } from "node:zlib";

const BUILD = fileURLToPath(new URL("../../../build/web/", import.meta.url));
const PACKAGE = path.join(BUILD, "package");
const WIDTH = 1280,
    HEIGHT = 720,
    FRAMES = 40,
    ROUNDS = 7;

const [file, program] = process.argv.slice(2);
if (file === undefined) {
    console.error("usage: measure.mjs MODEL.pbvg [PBM_RENDER]");
    process.exit(1);
}
const bytes = new Uint8Array(readFileSync(file));
const { loadPbm } = await import(pathToFileURL(path.join(PACKAGE, "pbm.node.js")).href);

// Milliseconds of processor time of this process: other programs do not count.
function processorTime() {
    const { user, system } = process.cpuUsage();
    return (user + system) / 1000;
}

const median = (values) => values.toSorted((a, b) => a - b)[values.length >> 1];

function measureSizes() {
    for (const name of readdirSync(PACKAGE).filter((name) => /\.(wasm|js)$/.test(name))) {
        const content = readFileSync(path.join(PACKAGE, name));
        console.log(
            `${name.padEnd(24)}${String(content.length).padStart(8)}${String(gzipSync(content, { level: 9 }).length).padStart(8)}`,
        );
    }
}

async function measureDecoding() {
    const wasm = readFileSync(path.join(BUILD, "bin/pbm_bench.wasm"));
    const { default: create } = await import(pathToFileURL(path.join(BUILD, "bin/pbm_bench.js")).href);
    let memory;
    const module = await create({
        instantiateWasm(imports, done) {
            WebAssembly.instantiate(wasm, imports).then(({ instance }) => {
                memory = Object.values(instance.exports).find((value) => value instanceof WebAssembly.Memory);
                done(instance);
            });
            return {};
        },
    });
    const address = module._malloc(bytes.length);
    new Uint8Array(memory.buffer, address, bytes.length).set(bytes);
    const times = [];
    let points = 0;
    for (let round = -2; round < ROUNDS; ++round) {
        const start = processorTime();
        points = module._pbm_bench_decode(address, bytes.length);
        if (round >= 0) times.push(processorTime() - start);
    }
    console.log(
        `decode   ${(points / median(times) / 1000).toFixed(1)} M points/s of the finest level (${points} points)`,
    );
}

function orbit(camera, turn) {
    const [x, y, z] = camera.position.map((value, axis) => value - camera.focalPoint[axis]);
    const position = [x * Math.cos(turn) + z * Math.sin(turn), y, z * Math.cos(turn) - x * Math.sin(turn)];
    return { ...camera, position: position.map((value, axis) => value + camera.focalPoint[axis]) };
}

function measureFrames(pbm) {
    const model = pbm.openBytes(bytes),
        camera = model.defaultCamera(WIDTH, HEIGHT),
        times = [];
    const now = pbm.threads === 1 ? processorTime : () => performance.now();
    for (let frame = -FRAMES; frame < FRAMES; ++frame) {
        // the first round loads and compiles
        const start = now();
        const picture = model.render({
            camera: orbit(camera, (2 * Math.PI * frame) / FRAMES),
            width: WIDTH,
            height: HEIGHT,
        });
        if (!picture.complete) throw picture.error;
        if (frame >= 0) times.push(now() - start);
    }
    model.close();
    console.log(`frames   ${median(times).toFixed(1)} ms, ${pbm.threads} thread(s)`);
}

function measureStream(pbm) {
    let arrived = 0,
        model = null,
        first = 0;
    const read = (offset, size) => (offset + size <= arrived ? bytes.subarray(offset, offset + size) : null);
    for (; ; arrived += 4096) {
        model ??= pbm.open({ size: bytes.length, read });
        const camera = model?.defaultCamera(WIDTH, HEIGHT);
        if (!camera) continue;
        first ||= arrived;
        const start = performance.now();
        const { complete } = model.render({ camera, width: WIDTH, height: HEIGHT });
        if (first === arrived)
            console.log(
                `stream   first picture after ${first} bytes, drawn in ${(performance.now() - start).toFixed(0)} ms`,
            );
        if (complete) {
            console.log(`stream   exact picture after ${arrived} bytes of ${bytes.length}`);
            return model.close();
        }
    }
}

measureSizes();
await measureDecoding();
for (const threads of [0, 2]) measureFrames(await loadPbm({ threads }));
measureStream(await loadPbm({ threads: 0 }));
if (program !== undefined)
    console.log(
        `native   ${execFileSync(program, ["-j1", "--quality", "fast", "--bench", String(FRAMES), "-o", "/dev/null.png", file])}`,
    );
process.exit(0); // workers
