// The picture that printers get. A page that is printed cannot wait for one: once a view has rested for a while, the element
// keeps a picture of it that has the resolution of a printer. It is made of what is in memory and costs no byte.

const REST = 1500; // ms without a change, before the picture is made
const PIXELS = 300 / 96; // a CSS pixel: 300 in an inch
const PAPER = { width: 2480, height: 3508 }; // A4 at 300 pixels an inch: more is not printed
const WORTH = 1.2; // times as wide as the picture on the screen, or that will do

export class Paper {
    #canvas;
    #draw;
    #timer = 0;
    #version = 0; // of the view

    // `canvas` has the class `ready` while it shows the picture of the view: policies may forbid images that scripts make.
    // `draw({width, height})`: a promise of the picture of that size as an ImageBitmap, or of null.
    constructor(canvas, draw) {
        this.#canvas = canvas;
        this.#draw = draw;
    }

    // The view rests. `screen`: {width, height} of its picture.
    prepare(screen) {
        const { clientWidth, clientHeight } = this.#canvas.parentNode.host;
        const scale = Math.min(PIXELS, PAPER.width / clientWidth, PAPER.height / clientHeight);
        const [width, height] = [clientWidth, clientHeight].map((edge) => Math.round(edge * scale));
        if (width < screen.width * WORTH) return;
        const version = this.#version;
        clearTimeout(this.#timer);
        this.#timer = setTimeout(async () => {
            const picture = await this.#draw({ width, height });
            if (picture && version === this.#version) this.#show(picture);
        }, REST);
    }

    #show(picture) {
        this.discard();
        const { width, height } = picture;
        Object.assign(this.#canvas, { width, height });
        this.#canvas.getContext("bitmaprenderer").transferFromImageBitmap(picture);
        this.#canvas.classList.add("ready");
    }

    // The view is another one.
    discard() {
        this.#version += 1;
        clearTimeout(this.#timer);
        if (!this.#canvas.classList.contains("ready")) return;
        this.#canvas.classList.remove("ready");
        Object.assign(this.#canvas, { width: 1, height: 1 }); // frees the picture
    }
}
