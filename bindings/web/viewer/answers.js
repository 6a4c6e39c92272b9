// The first answer of a server, which the page asks for while its worker starts, and hands on:
//
//   answer {status, statusText, headers}   what Response has
//   part {bytes}                           of its body
//   end {reason}                           of the body, or of the attempt: a text if the network failed, else null

// The first request: header, small sections and the coarse levels of most models.
export const FIRST_BYTES = 64 * 1024;

// Page: asks for the first `bytes` of `url`, and sends messages until the signal aborts.
export async function forwardAnswer(url, bytes, post, signal) {
    let reason = null;
    try {
        const response = await fetch(url, { headers: { Range: `bytes=0-${bytes - 1}` }, signal });
        const { status, statusText, headers, body } = response;
        post({ type: "answer", status, statusText, headers: [...headers] });
        for (const reader = body.getReader(); ; ) {
            const { done, value } = await reader.read();
            if (done || signal.aborted) break;
            // The part may be a view of more bytes than it has.
            const own = value.byteLength === value.buffer.byteLength ? value : value.slice();
            post({ type: "part", bytes: own }, [own.buffer]);
        }
    } catch (error) {
        reason = error.message;
    }
    if (!signal.aborted) post({ type: "end", reason });
}

// Worker: makes a Response of the messages.
export class ForwardedAnswer {
    #resolve;
    #reject;
    #stream = null;
    #enough;
    // Rejects if the network fails before there is an answer.
    response = new Promise((resolve, reject) => {
        this.#resolve = resolve;
        this.#reject = reject;
    });

    // `enough()` is called when nobody wants the rest.
    constructor(enough) {
        this.#enough = enough;
        this.response.catch(() => {}); // it may be asked for later, or never
    }

    answer({ status, statusText, headers }) {
        const body = new ReadableStream({
            start: (stream) => {
                this.#stream = stream;
            },
            cancel: () => {
                this.#stream = null;
                this.#enough();
            },
        });
        // Statuses without a body must have none.
        this.#resolve(new Response([204, 205, 304].includes(status) ? null : body, { status, statusText, headers }));
    }

    part({ bytes }) {
        this.#stream?.enqueue(bytes);
    }

    end({ reason }) {
        if (reason === null) this.#stream?.close();
        else {
            this.#stream?.error(new TypeError(reason));
            this.#reject(new TypeError(reason));
        }
    }
}
