"""What stands around the pieces of programs that pages show."""

C = """#include <stdio.h>
#include <stdlib.h>
@0@
struct download { int calls, is_complete; FILE *file; };
static int copy_if_there(struct download *from, uint64_t offset, uint64_t size, void *to) {
    if (from->calls++ < 5 || fseek(from->file, (long)offset, SEEK_SET) != 0)
        return 0;
    return fread(to, 1, size, from->file) == size;
}
static void start_fetching(struct download *from, uint64_t offset, uint64_t size) { (void)from, (void)offset, (void)size; }
static void wait_for_some_bytes(struct download *from) { (void)from; }
static void show(const pbm_picture *picture) { (void)picture; }
@3@
int main(void) {
    @open@
    @1@
    if (positions[0] == 0)
        return 1;
    {
        const uint64_t vertex_count = 3, face_count = 1;
        const double vertices[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
        const uint32_t faces[] = {0, 1, 2};
        @2@
        if (code != PBM_OK)
            return 2;
    }
    {
        struct download download = {0, 0, fopen("bust.pbvg", "rb")};
        static uint8_t pixels[30][40][4];
        pbm_camera camera = PBM_NEW(pbm_camera);
        pbm_picture picture = PBM_NEW(pbm_picture);
        pbm_default_camera(model, 40, 30, &camera, &error);
        fseek(download.file, 0, SEEK_END);
        const uint64_t size = (uint64_t)ftell(download.file);
        pbm_model *ranged = NULL;
        do
            code_of_opening = pbm_open_ranges(read_range, &download, size, &ranged, &error);
        while (code_of_opening == PBM_PENDING);
        pbm_close(model);
        model = ranged;
        picture.width = 40;
        picture.height = 30;
        picture.pixels = &pixels[0][0][0];
        picture.pixel_bytes = sizeof pixels;
        @4@
        return pixels[15][20][0] == pixels[0][0][0] ? 3 : 0;
    }
}
"""

CPP = """#include <pbm/format.h>
#include <fstream>
#include <iostream>
#include <iterator>
#include <vector>
int main() {
    std::ifstream file("scan.pbvg", std::ios::binary);
    const std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(file), {}};
    @
    return report.findings.empty() && !bytes.empty() ? 0 : 1;
}
"""

CMAKE_HEAD = """cmake_minimum_required(VERSION 3.25)
project(page LANGUAGES C CXX)
file(WRITE ${CMAKE_BINARY_DIR}/empty.cpp "int main() {}")
foreach(name my_program my_reader my_viewer my_baker my_importer)
    add_executable(${name} ${CMAKE_BINARY_DIR}/empty.cpp)
endforeach()
"""

MESON_HEAD = "project('page')\n"

# Before the blocks of the page on Python, in one program with them.
PYTHON = '''import http.server, pathlib, shutil, threading
import numpy
import pbm

side = numpy.linspace(-1, 1, 60)
x, z = (axis.ravel() for axis in numpy.meshgrid(side, side))
vertices = numpy.stack([x, 0.2 * numpy.sin(5 * x) * numpy.cos(4 * z), z], -1)
corner = (numpy.arange(59) + 60 * numpy.arange(59)[:, None]).ravel()
faces = numpy.concatenate([numpy.stack([corner, corner + 60, corner + 1], -1),
                           numpy.stack([corner + 1, corner + 60, corner + 61], -1)])
colours = numpy.full((len(vertices), 3), 120, numpy.uint8)
slopes = 90 * abs(x)


class Ranges(http.server.BaseHTTPRequestHandler):
    def do_GET(self):
        first, last = map(int, self.headers["Range"].removeprefix("bytes=").split("-"))
        self.send_response(206)
        self.end_headers()
        self.wfile.write(pathlib.Path("bust.pbvg").read_bytes()[first:last + 1])

    def log_message(self, *_):
        pass


server = http.server.HTTPServer(("127.0.0.1", 0), Ranges)
threading.Thread(target=server.serve_forever, daemon=True).start()
url, size = f"http://127.0.0.1:{server.server_port}/", pathlib.Path("bust.pbvg").stat().st_size
'''
