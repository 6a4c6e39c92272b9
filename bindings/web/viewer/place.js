// Where points of the window lie in an element, whatever CSS does to the element: rotate, scale, skew.

export class Place {
    #corners;

    // `corners`: elements without size at its top left, top right and bottom left corner.
    constructor(corners) {
        this.#corners = corners;
    }

    #axes() {
        const [origin, right, down] = this.#corners.map((corner) => {
            const { left, top } = corner.getBoundingClientRect();
            return [left, top];
        });
        return { origin, right: right.map((x, i) => x - origin[i]), down: down.map((x, i) => x - origin[i]) };
    }

    // Client coordinates as parts of the element's width and height.
    partsOf(clientX, clientY) {
        const { origin, right, down } = this.#axes();
        const [x, y] = [clientX - origin[0], clientY - origin[1]];
        const area = right[0] * down[1] - right[1] * down[0];
        return { x: (x * down[1] - y * down[0]) / area, y: (y * right[0] - x * right[1]) / area };
    }

    // Client coordinates of the middle.
    middle() {
        const { origin, right, down } = this.#axes();
        return { x: origin[0] + (right[0] + down[0]) / 2, y: origin[1] + (right[1] + down[1]) / 2 };
    }
}
