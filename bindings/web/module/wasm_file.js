// Fetches and compiles a file of WebAssembly, as patiently as the bytes of a model are fetched.

const DELAYS = [500, 1000, 2000]; // ms before each repetition
const PATIENCE = 10000; // ms without a byte after which a connection is given up; doubled each time

// `arrived(bytes)` hears how many bytes have arrived. Throws an Error whose message says what network or server did.
export async function compileFile(url, arrived = () => {}) {
    for (let times = 0; ; ++times) {
        try {
            return await compileOnce(url, PATIENCE * 2 ** times, arrived);
        } catch (error) {
            if (error instanceof WebAssembly.CompileError || error.isFinal || times === DELAYS.length) throw error;
            await new Promise((resolve) => setTimeout(resolve, DELAYS[times]));
        }
    }
}

async function compileOnce(url, patience, arrived) {
    const connection = new AbortController();
    let timer;
    const expect = () => {
        clearTimeout(timer);
        timer = setTimeout(() => connection.abort(new Error("no answer")), patience);
    };
    expect();
    try {
        const response = await fetch(url, { signal: connection.signal });
        if (!response.ok) throw Object.assign(new Error(`HTTP ${response.status}`), { isFinal: !isPassing(response.status) });
        let bytes = 0;
        const watched = new TransformStream({
            transform(part, stream) {
                expect();
                arrived((bytes += part.length));
                stream.enqueue(part);
            },
        });
        // Hosts that do not know the media type send the file as bytes.
        const headers = { "Content-Type": "application/wasm" };
        return await WebAssembly.compileStreaming(new Response(response.body.pipeThrough(watched), { headers }));
    } finally {
        clearTimeout(timer);
    }
}

// Whether a server may answer otherwise when it is asked again.
export function isPassing(status) {
    return status >= 500 || status === 429 || status === 408;
}
