// Threads in node: emscripten's workers as they are in a browser.

// What a worker of a browser has, before its script runs.
const PRELUDE = `
const { parentPort, workerData } = require('node:worker_threads');
globalThis.self = globalThis;
globalThis.importScripts = () => {};
globalThis.location = { href: workerData };
globalThis.postMessage = (message) => parentPort.postMessage(message);
parentPort.on('message', (data) => globalThis.onmessage({ data }));
`;

/** Defines the class Worker of browsers, as far as emscripten uses it. */
export async function provideWorkers() {
    const { Worker } = await import("node:worker_threads");
    const { readFileSync } = await import("node:fs");
    const { pathToFileURL } = await import("node:url");
    globalThis.Worker ??= class {
        #worker;

        constructor(url) {
            const script = readFileSync(new URL(url), "utf8");
            this.#worker = new Worker(PRELUDE + script, { eval: true, workerData: String(url) });
            this.#worker.on("message", (data) => {
                if (data.cmd === "loaded") this.#worker.unref(); // from now on it does not keep node running
                this.onmessage?.({ data });
            });
            this.#worker.on("error", (error) => this.onerror?.({ message: error.message, filename: url, lineno: 0 }));
        }

        postMessage(message) {
            this.#worker.postMessage(message);
        }
        terminate() {
            return this.#worker.terminate();
        }
    };
}
