#include <pbm/pbm.h>

#include <stdio.h>

enum { WIDTH = 640, HEIGHT = 480 };
static uint8_t pixels[HEIGHT][WIDTH][4];

static int fail(const pbm_error *error) {
    fprintf(stderr, "%s\n", error->message);
    return error->code;
}

int main(int argc, char **argv) {
    pbm_error error;
    pbm_model *model;
    pbm_camera camera = PBM_NEW(pbm_camera);
    pbm_picture picture = PBM_NEW(pbm_picture);
    FILE *file;
    if (argc != 3) {
        fprintf(stderr, "usage: draw_model FILE.pbvg PICTURE.ppm\n");
        return PBM_USAGE;
    }
    if (pbm_open_file(argv[1], &model, &error) != PBM_OK)
        return fail(&error);
    picture.width = WIDTH;
    picture.height = HEIGHT;
    picture.pixels = &pixels[0][0][0];
    picture.pixel_bytes = sizeof pixels;
    if (pbm_default_camera(model, WIDTH, HEIGHT, &camera, &error) != PBM_OK ||
        pbm_render(model, &camera, NULL, &picture, &error) != PBM_OK)
        return fail(&error);
    pbm_close(model);
    file = fopen(argv[2], "wb");
    if (file == NULL)
        return PBM_IO;
    fprintf(file, "P6 %d %d 255\n", WIDTH, HEIGHT);
    for (int y = 0; y < HEIGHT; ++y)
        for (int x = 0; x < WIDTH; ++x)
            fwrite(pixels[y][x], 1, 3, file);
    return fclose(file) == 0 ? PBM_OK : PBM_IO;
}
