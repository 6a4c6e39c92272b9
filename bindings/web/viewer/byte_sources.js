// Where the bytes of a model come from. A source puts bytes into a ByteStore as they arrive:
//
//   openUrl   requests ranges, if the server answers the first one; else reads the one answer as it arrives
//   openBlob  reads slices of a Blob
//
// Both return a source:
//   size         bytes that the file has on the server or disk; null while unknown
//   want(ranges) fetch these ([from, to], most urgent first) and nothing else; requests that run and bring none of
//                them are cancelled
//   close()      ends everything
//   figures      {bytes, requests}: bytes that arrived and requests that were made
//
// `listener` hears of what happens:
//   arrived()                   there are new bytes, or the size is known
//   failed(error)               a SourceError; no further bytes will come
//   waiting(error, times)       the network failed this many times in a row, and the source tries again; 0 times: the
//                               server does not answer, and the source waits; null: it is back
import { CODES } from "../module/errors.js";
import { plan } from "./ranges.js";

// The first request: header, small sections and the coarse levels of most models.
export const FIRST_BYTES = 64 * 1024;
const PARALLEL = 3;
const FIRST_DELAY = 500; // ms before the first repetition; doubled each time
const LONGEST_DELAY = 15000;
// Failures in a row before the first answer, from which on each repetition tries without Range, too: browsers refuse
// a server that compresses what it answers to a range.
const RANGES_TRIED = 2;
const PATIENCE = 10000; // ms without a byte, until the listener hears of it

export class SourceError extends Error {
    constructor(name, message, code = CODES.IO) {
        super(message);
        Object.assign(this, { name, code, offset: null });
    }
}

function changed() {
    return new SourceError("server.changed", "The file changed on the server: load the page again.");
}

// The server breaks the rules of range requests (RFC 9110, section 14).
class RangeLie extends Error {}

// `Content-Range: bytes 0-99/1000` as {from, to, size}, or null: absent, or hidden from scripts by CORS.
function contentRange(response) {
    const header = response.headers.get("content-range");
    if (header === null) return null;
    const parts = /^bytes (\d+)-(\d+)\/(\d+|\*)$/.exec(header);
    if (!parts) throw new RangeLie(`it sent "Content-Range: ${header}"`);
    return { from: +parts[1], to: +parts[2] + 1, size: parts[3] === "*" ? null : +parts[3] };
}

export function openUrl(url, store, listener) {
    return new UrlSource(url, store, listener);
}

class UrlSource {
    size = null;
    figures = { bytes: 0, requests: 0 };
    #url;
    #store;
    #listener;
    #running = new Set(); // {from, at, to, abort}
    #queue = []; // ranges to request, most urgent first
    #streamed = false; // the server answers without ranges
    #version = null; // validator of the file on the server: ETag, or its date
    #stated = null; // size, while the server still answered ranges
    #closed = new AbortController();
    #failures = 0; // in a row
    #withoutRange = false; // the next request
    #stall = null; // timer of the next notice that no byte comes
    #stalled = false;
    #pause = null; // promise while waiting for the network

    constructor(url, store, listener) {
        this.#url = url;
        this.#store = store;
        this.#listener = listener;
        this.#start([0, FIRST_BYTES]);
    }

    want(ranges) {
        if (this.#streamed || this.figures.bytes === 0 || this.#closed.signal.aborted) return;
        const { cancelled, requests } = plan(ranges, [...this.#running]);
        for (const request of cancelled) request.abort.abort();
        this.#queue = requests;
        this.#next();
    }

    close() {
        this.#closed.abort();
        this.#queue = [];
        for (const request of this.#running) request.abort.abort();
        clearTimeout(this.#stall);
    }

    #next() {
        while (this.#running.size < PARALLEL && this.#queue.length > 0) this.#start(this.#queue.shift());
    }

    async #start([from, to]) {
        const request = { from, at: from, to, abort: new AbortController() };
        this.#running.add(request);
        try {
            await this.#repeat(request);
        } catch (error) {
            if (request.abort.signal.aborted) return;
            if (error instanceof RangeLie && !this.#streamed) this.#readWhole(error);
            else this.#fail(error);
        } finally {
            this.#running.delete(request);
            if (this.#running.size === 0) clearTimeout(this.#stall);
            this.#next();
        }
    }

    // Bytes are expected from now on.
    #expect() {
        clearTimeout(this.#stall);
        this.#stall = setTimeout(() => {
            this.#stalled = true;
            const text = `The server does not answer for ${this.#url}. The viewer waits for it.`;
            this.#listener.waiting(new SourceError("network", text), 0);
        }, PATIENCE);
    }

    // Until all bytes are here. Only what the network is to blame for is repeated.
    async #repeat(request) {
        while (request.at < request.to) {
            await this.#pause;
            if (request.abort.signal.aborted) return;
            try {
                await this.#fetch(request);
            } catch (error) {
                if (request.abort.signal.aborted) return;
                if (error instanceof RangeLie || error instanceof SourceError) throw error;
                // There is no network to wait for.
                if (!/^https?:/.test(this.#url))
                    throw new SourceError("address", `${this.#url} cannot be read (${error.message}).`);
                this.#withoutRange =
                    !this.#withoutRange && this.figures.bytes === 0 && this.#failures >= RANGES_TRIED;
                if (!this.#withoutRange) this.#wait(error);
            }
        }
    }

    async #fetch(request) {
        const asked = { from: request.at, to: request.to };
        const whole = (this.#streamed || this.#withoutRange) && asked.from === 0;
        this.#expect();
        this.figures.requests += 1;
        const response = await fetch(this.#url, {
            headers: whole ? {} : { Range: `bytes=${asked.from}-${Number.isFinite(asked.to) ? asked.to - 1 : ""}` },
            signal: request.abort.signal,
        });
        this.#checkStatus(response);
        this.#checkVersion(response);
        if (response.status === 206) return this.#takeRange(request, response, asked);
        if (!this.#streamed && this.size !== null)
            throw new RangeLie("it answered some ranges, and then the whole file");
        this.#streamed = true;
        this.#queue = [];
        request.to = Infinity;
        await this.#takeBody(request, response, 0);
        this.#setEnd(request);
    }

    #checkStatus(response) {
        const { status, statusText } = response;
        if (status === 200 || status === 206) return;
        if (status === 416) throw new RangeLie("it answered 416 to a range inside the file");
        const text = `The server answered ${status} ${statusText} for ${this.#url}.`;
        if (status >= 500 || status === 429 || status === 408) throw new Error(text);
        throw new SourceError("server.status", text);
    }

    #checkVersion(response) {
        const version = response.headers.get("etag") ?? response.headers.get("last-modified");
        if (this.#version !== null && version !== null && version !== this.#version) throw changed();
        this.#version ??= version;
    }

    async #takeRange(request, response, asked) {
        const range = contentRange(response);
        let end = asked.to;
        if (range) {
            end = Math.min(asked.to, range.size ?? asked.to);
            if (range.from !== asked.from || range.to <= range.from || range.to > end)
                throw new RangeLie(
                    `it sent bytes ${range.from} to ${range.to} where ${asked.from} to ${end} were asked for`,
                );
            if (this.size !== null && range.size !== null && range.size !== this.size)
                throw new RangeLie(`it states a size of ${range.size} bytes, and stated ${this.size} before`);
            this.size ??= range.size;
            request.to = end;
            end = range.to;
        }
        await this.#takeBody(request, response, asked.from, end);
        if (request.at === asked.from) throw new Error("The server sent no bytes.");
        if (range) return;
        // CORS hides Content-Range. An answer that ends early ends with the file.
        if (request.at < request.to) this.#setEnd(request);
    }

    #setEnd(request) {
        if (this.#stated !== null && request.at !== this.#stated) throw changed();
        this.size = request.at;
        request.to = request.at;
        this.#listener.arrived();
    }

    // Puts the bytes of an answer that begin at `offset` into the store, and no byte from `end` on.
    async #takeBody(request, response, offset, end = Infinity) {
        const reader = response.body.getReader();
        for (let at = offset; ;) {
            const { done, value } = await reader.read();
            if (done) return;
            this.#expect();
            this.#recover();
            this.figures.bytes += value.length;
            if (at + value.length > end)
                throw new RangeLie(`it sent more than the ${end - offset} bytes that it announced`);
            if (this.#streamed && at + value.length > this.#store.budget)
                throw new SourceError(
                    "limit.memory",
                    "The server answers no ranges, and the whole file needs more memory " +
                        "than max-memory allows: finer detail is left out.",
                    CODES.LIMIT,
                );
            this.#store.put(at, value);
            at += value.length;
            request.at = Math.max(request.at, at);
            this.#listener.arrived();
        }
    }

    // The server lies about ranges: one plain request instead, and none of its bytes is kept.
    #readWhole(lie) {
        console.warn(
            `pbm-viewer: the server breaks the rules of range requests for ${this.#url}: ${lie.message}.` +
                " The viewer reads the whole file instead.",
        );
        for (const request of this.#running) request.abort.abort();
        this.#store.clear();
        this.#streamed = true;
        this.#queue = [];
        this.#stated = this.size;
        this.size = null;
        this.#start([0, Infinity]);
    }

    #wait(error) {
        if (this.#pause) return;
        clearTimeout(this.#stall);
        const delay = Math.min(FIRST_DELAY * 2 ** this.#failures, LONGEST_DELAY);
        this.#failures += 1;
        this.#listener.waiting(
            new SourceError("network", `${this.#url} cannot be read (${error.message}). The viewer tries again.`),
            this.#failures,
        );
        this.#pause = new Promise((resolve) => {
            const go = () => {
                clearTimeout(timer);
                globalThis.removeEventListener?.("online", go);
                this.#pause = null;
                resolve();
            };
            const timer = setTimeout(go, delay);
            globalThis.addEventListener?.("online", go);
        });
    }

    #recover() {
        if (this.#failures === 0 && !this.#stalled) return;
        this.#failures = 0;
        this.#stalled = false;
        this.#listener.waiting(null, 0);
    }

    #fail(error) {
        if (this.#closed.signal.aborted) return;
        this.close();
        this.#recover(); // no notice of the network hides the error
        this.#listener.failed(
            error instanceof SourceError
                ? error
                : new SourceError(
                      "server.ranges",
                      `The server breaks the rules of range requests for ${this.#url}: ${error.message}.`,
                  ),
        );
    }
}

export function openBlob(blob, store, listener) {
    let closed = false;
    let queue = [];
    let running = false;
    const figures = { bytes: 0, requests: 0 };
    async function read() {
        if (running) return;
        running = true;
        try {
            while (queue.length > 0 && !closed) {
                const [from, to] = queue.shift();
                const bytes = new Uint8Array(await blob.slice(from, to).arrayBuffer());
                figures.bytes += bytes.length;
                figures.requests += 1;
                store.put(from, bytes);
                if (!closed) listener.arrived();
            }
        } catch {
            if (!closed) listener.failed(new SourceError("file", "The file can no longer be read: open it again."));
        }
        running = false;
    }
    const source = {
        size: blob.size,
        figures,
        want(ranges) {
            queue = plan(ranges, []).requests;
            read();
        },
        close() {
            closed = true;
        },
    };
    source.want([[0, Math.min(blob.size, FIRST_BYTES)]]);
    return source;
}
