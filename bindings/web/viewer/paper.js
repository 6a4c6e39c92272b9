// The picture that printers get. A page that is printed cannot wait for one: once a view has rested for a while, the element
// keeps a picture of it that has the resolution of a printer. It is made of what is in memory and costs no byte.

const REST = 1500; // ms without a change, before the picture is made
const PIXELS = 300 / 96; // a CSS pixel: 300 in an inch
const PAPER = { width: 2480, height: 3508 }; // A4 at 300 pixels an inch: more is not printed
const WORTH = 1.2; // times as wide as the picture on the screen, or that will do

export class Paper {
    #image;
    #draw;
    #timer = 0;
    #version = 0; // of the view

    // `image`: an element <img>. `draw({width, height})`: a promise of the picture of that size as a Blob, or of null.
    constructor(image, draw) {
        this.#image = image;
        this.#draw = draw;
    }

    // The view rests. `screen`: {width, height} of its picture.
    prepare(screen) {
        const { clientWidth, clientHeight } = this.#image.parentNode.host;
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
        this.#image.src = URL.createObjectURL(picture);
    }

    // The view is another one.
    discard() {
        this.#version += 1;
        clearTimeout(this.#timer);
        if (!this.#image.hasAttribute("src")) return;
        URL.revokeObjectURL(this.#image.src);
        this.#image.removeAttribute("src");
    }
}
