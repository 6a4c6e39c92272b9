// PBM for Node: pbm.js with the files and threads of Node. The export condition `node` of the package leads here.
import { readFile } from "node:fs/promises";
import { provideWorkers } from "./node_workers.js";
import { platform } from "./platform.js";

const compileFetched = platform.compile;
Object.assign(platform, {
    compile: async (url) =>
        new URL(url).protocol === "file:" ? WebAssembly.compile(await readFile(new URL(url))) : compileFetched(url),
    canShare: () => true,
    prepareThreads: provideWorkers,
    // Emscripten takes this thread for one of a page, which must not wait.
    warn: (text) => text.startsWith("Blocking on the main thread") || console.warn(text),
});
export * from "./pbm.js";
