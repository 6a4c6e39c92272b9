// What differs between browsers and Node. pbm.node.js replaces these functions.
import { usage } from "./errors.js";
import { compileFile } from "./wasm_file.js";

export const platform = {
    /** The module of a file of WebAssembly. */
    compile: compileFile,
    /** Whether threads can share memory. */
    canShare: () => typeof SharedArrayBuffer === "function" && globalThis.crossOriginIsolated === true,
    /** Before the first thread. */
    async prepareThreads() {},
    /** What a module complains of. */
    warn: (text) => console.warn(text),
};

const MAX_THREADS = 16;

/** How many threads draw if `asked` ("auto", 0 or a number) are asked for. */
export function threadsOf(asked) {
    if (asked !== "auto" && !(Number.isInteger(asked) && asked >= 0))
        throw usage(`threads is ${asked}, not 'auto', 0 or a number`);
    if (!platform.canShare()) return 1;
    const processors = globalThis.navigator?.hardwareConcurrency ?? 1;
    return Math.max(1, Math.min(MAX_THREADS, asked === "auto" ? processors : asked));
}
