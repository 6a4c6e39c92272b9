// Images that OBJ and PLY files name.
#include "pbm_scan/images/files_beside.h"
#include "pbm_scan/images/read_image.h"
#include "pbm_scan/surface_reader.h"
#include "unit/support/image_files.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <unistd.h>
#include <webp/encode.h>

namespace {

using namespace pbm;
using namespace pbm::build;

class ImageInputs : public testing::Test {
  protected:
    ImageInputs() { std::filesystem::create_directories(folder_ / "Skins"); }
    ~ImageInputs() override { std::filesystem::remove_all(folder_); }

    void write(const std::string &name, const std::string &text) const {
        std::ofstream(folder_ / name, std::ios::binary) << text;
    }
    void write_png(const std::string &name, std::uint8_t grey) const {
        const Bytes pixels(12, grey);
        write(name, text_of(test::png_of(2, 2, PNG_FORMAT_RGB, pixels.data())));
    }
    static std::string text_of(const Bytes &bytes) { return {bytes.begin(), bytes.end()}; }
    Surface read(const std::string &name, const ReadOptions &options = {}) const {
        Result<Surface> surface = read_surface((folder_ / name).string(), options);
        EXPECT_TRUE(surface.ok()) << (surface.ok() ? "" : surface.error().message);
        return surface.ok() ? std::move(*surface) : Surface{};
    }
    std::vector<std::string> further(const std::string &name) const {
        std::vector<std::string> names;
        for (const NamedFile &named : further_files((folder_ / name).string()))
            names.push_back(named.file.empty() ? "no " + named.name
                                               : std::filesystem::path(named.file).filename().string());
        return names;
    }
    std::string path(const std::string &name) const { return (folder_ / name).string(); }

  private:
    std::filesystem::path folder_ =
        std::filesystem::path(testing::TempDir()) / ("pbm_images_" + std::to_string(::getpid()));
};

std::string note_of(const Surface &surface, const std::string &name) {
    const auto found = std::find_if(surface.report.begin(), surface.report.end(),
                                    [&](const AttributeReport &line) { return line.name == name; });
    return found == surface.report.end() ? "no such line"
                                         : std::string(found->fate == Fate::dropped ? "dropped: " : "") + found->note;
}

const std::string kQuad = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";

TEST_F(ImageInputs, AnObjHasTheImagesOfItsMaterials) {
    write("scan.mtl", "newmtl a\nmap_Kd -s 2 3 1 -o 0.25 0.5 -clamp on -mm 0 1 first skin.png\nnewmtl b\nKd 1 0 0\n"
                      "newmtl c\nmap_Kd SKINS\\Second.PNG\nnewmtl d\nmap_Kd missing.png\n");
    write_png("first skin.png", 10);
    write_png("Skins/second.png", 20);
    write("scan.obj",
          "mtllib scan.mtl\n" + kQuad +
              "usemtl a\nf 1/1 2/2 3/3 4/4\nusemtl b\nf 1/1 2/2 3/3\nusemtl c\nf -4/-4 -3/-3 -2/-2\nf 1 2 3\n"
              "usemtl d\nf 1/1 2/2 3/3\n");
    const Surface s = read("scan.obj");
    ASSERT_EQ(s.textures.size(), 2U);
    EXPECT_EQ(s.texture_ids,
              (std::vector<std::uint16_t>{0, 0, Surface::kNoTexture, 1, Surface::kNoTexture, Surface::kNoTexture}));
    EXPECT_EQ(s.textures[0].texels[0][0], 10);
    EXPECT_EQ(s.textures[1].texels[3][2], 20);
    EXPECT_EQ(s.textures[0].use.wrap, (std::array{Wrap::clamp, Wrap::clamp}));
    EXPECT_EQ(s.textures[1].use.wrap, (std::array{Wrap::repeat, Wrap::repeat}));
    // Upwards in the file, downwards here.
    EXPECT_EQ(s.texture_corners[1], (TextureCorners{{{0.25F, 0.5F}, {2.25F, -2.5F}, {0.25F, -2.5F}}}));
    EXPECT_EQ(s.texture_corners[3], (TextureCorners{{{0, 1}, {1, 1}, {1, 0}}}));
    EXPECT_EQ(note_of(s, "texture image 'first skin.png'"), "2 x 2, to colours of points");
    EXPECT_EQ(note_of(s, "texture image 'missing.png'"), "dropped: there is no such file");
    EXPECT_EQ(note_of(s, "texture coordinates"), "colours of points; 3 triangles have no image");
    EXPECT_EQ(note_of(s, "option -mm of images"), "dropped: not used by PBM");
    EXPECT_EQ(further("scan.obj"),
              (std::vector<std::string>{"scan.mtl", "first skin.png", "second.png", "no missing.png"}));
}

TEST_F(ImageInputs, AnObjHasTheNormalMapsOfItsMaterials) {
    write("scan.mtl", "newmtl a\nnorm -s 2 2 -bm 0.5 normals.png\nnewmtl b\nmap_Bump -bm 2 -clamp on heights.png\n"
                      "newmtl c\nbump normals.png\nnewmtl d\nbump heights.png\nnorm normals.png\n"
                      "newmtl e\nnorm missing.png\nnewmtl f\nnorm heights.png\n");
    const Bytes normals{10, 20, 250, 10, 20, 250, 10, 20, 250, 10, 20, 250};
    write("normals.png", text_of(test::png_of(2, 2, PNG_FORMAT_RGB, normals.data())));
    const Bytes heights{0, 100, 200, 0, 100, 200, 0, 100, 200}; // a slope to the right
    write("heights.png", text_of(test::png_of(3, 3, PNG_FORMAT_GRAY, heights.data())));
    std::string faces = "mtllib scan.mtl\n" + kQuad;
    for (const char material : {'a', 'b', 'c', 'd', 'e', 'f'})
        faces += std::string("usemtl ") + material + "\nf 1/1 2/2 3/3\n";
    write("scan.obj", faces);
    const Surface s = read("scan.obj");
    const ImageLayer &layer = s.layer(Layer::normals);
    EXPECT_TRUE(s.texture_ids.empty());
    ASSERT_EQ(layer.ids, (std::vector<std::uint16_t>{0, 1, 2, 3, Surface::kNoTexture, 4}));
    for (const Texture &map : s.textures)
        EXPECT_EQ(map.use.content, ImageContent::normals);
    EXPECT_EQ(s.textures[0].texels[0], (std::array<std::uint8_t, 4>{10, 20, 250, 255}));
    EXPECT_EQ(s.textures[0].use.relief, 0.5F);
    EXPECT_EQ(layer.corners[0], (TextureCorners{{{0, 1}, {2, 1}, {2, -1}}}));
    // 100 / 255 from texel to texel, times 2 x 2 % of three texels: a slope of 0.047.
    EXPECT_EQ(s.textures[1].texels[4], (std::array<std::uint8_t, 4>{122, 128, 255, 255}));
    EXPECT_EQ(s.textures[1].use.relief, 1);
    EXPECT_EQ(s.textures[1].use.wrap, (std::array{Wrap::clamp, Wrap::clamp}));
    EXPECT_EQ(s.textures[2].texels[0][1], 20);  // coloured: no heights
    EXPECT_EQ(s.textures[4].texels[1][0], 100); // norm: normals, even if they are grey
    EXPECT_EQ(note_of(s, "texture image 'normals.png'"), "2 x 2, to normals of points");
    EXPECT_EQ(note_of(s, "texture image 'heights.png'"), "3 x 3, heights, to normals of points");
    EXPECT_EQ(note_of(s, "texture image 'missing.png'"), "dropped: there is no such file");
    EXPECT_EQ(note_of(s, "bump of materials"), "dropped: norm says the same, and more");
    EXPECT_EQ(note_of(s, "texture coordinates"), "normals of points");
    ReadOptions flipped;
    flipped.flip_green = true;
    const Surface downwards = read("scan.obj", flipped);
    EXPECT_EQ(downwards.textures[0].texels[0], (std::array<std::uint8_t, 4>{10, 235, 250, 255}));
    EXPECT_EQ(downwards.textures[1].texels, s.textures[1].texels); // heights have no green
}

TEST_F(ImageInputs, PolygonsKeepThePlacesOfTheirCorners) {
    write("scan.mtl", "newmtl a\nmap_Kd a.png\n");
    write_png("a.png", 10);
    // A concave polygon, whose triangles are no fan; vertex 2 has another place in each face.
    write("scan.obj", "mtllib scan.mtl\nusemtl a\nv 0 0 0\nv 4 0 0\nv 4 4 0\nv 1 1 0\nv 0 4 0\n"
                      "vt 0 0\nvt 0.4 0\nvt 0.4 0.4\nvt 0.1 0.1\nvt 0 0.4\nvt 0.9 0.9\n"
                      "f 1/1 2/2 3/3 4/4 5/5\nf 1/1 2/6 3/3\n");
    const Surface s = read("scan.obj");
    ASSERT_EQ(s.triangles.size(), 4U);
    for (std::size_t i = 0; i < 3; ++i)
        for (int corner = 0; corner < 3; ++corner) {
            const glm::dvec3 &p = s.positions[s.triangles[i][corner]];
            EXPECT_NEAR(s.texture_corners[i][static_cast<std::size_t>(corner)].x, p.x / 10, 1e-6);
            EXPECT_NEAR(s.texture_corners[i][static_cast<std::size_t>(corner)].y, 1 - p.y / 10, 1e-6);
        }
    EXPECT_NEAR(s.texture_corners[3][1].x, 0.9, 1e-6);
}

TEST_F(ImageInputs, APlyHasPlacesOfVerticesOrOfCorners) {
    write_png("scan_A.png", 10);
    write_png("b.png", 20);
    const std::string head = "ply\nformat ascii 1.0\ncomment TextureFile <this>_A.png\ncomment TextureFile b.png\n"
                             "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n";
    write("scan.ply", head +
                          "property float s\nproperty float t\nelement face 1\nproperty list uchar int vertex_indices\n"
                          "end_header\n0 0 0 0 0\n1 0 0 1 0\n1 1 0 1 1\n0 1 0 0 1\n4 0 1 2 3\n");
    const Surface of_vertices = read("scan.ply");
    EXPECT_EQ(of_vertices.texture_ids, (std::vector<std::uint16_t>{0, 0}));
    EXPECT_EQ(of_vertices.texture_corners[1], (TextureCorners{{{0, 1}, {1, 0}, {0, 0}}}));
    EXPECT_EQ(further("scan.ply"), (std::vector<std::string>{"scan_A.png", "b.png"}));

    write("scan.ply", head + "element face 3\nproperty list uchar int vertex_indices\n"
                             "property list uchar float texcoord\nproperty int texnumber\nend_header\n"
                             "0 0 0\n1 0 0\n1 1 0\n0 1 0\n"
                             "4 0 1 2 3 8 0 0 1 0 1 1 0 1 1\n3 0 1 2 0 -1\n3 0 1 2 6 0 0 0.5 0 0.5 0.5 0\n");
    const Surface of_corners = read("scan.ply");
    EXPECT_EQ(of_corners.texture_ids, (std::vector<std::uint16_t>{1, 1, Surface::kNoTexture, 0}));
    EXPECT_EQ(of_corners.texture_corners[3], (TextureCorners{{{0, 1}, {0.5F, 1}, {0.5F, 0.5F}}}));
    EXPECT_EQ(of_corners.textures[1].texels[0][0], 20);
}

TEST_F(ImageInputs, TheOpacityOfAnObjHasImagesOfItsOwn) {
    write("scan.obj", "mtllib scan.mtl\nusemtl a\n" + kQuad + "f 1/1 2/2 3/3 4/4\n");
    const auto write_pixels = [&](const char *name, std::uint32_t width, std::uint32_t format, const Bytes &pixels) {
        const Bytes png = test::png_of(width, 1, format, pixels.data());
        write(name, std::string(png.begin(), png.end()));
    };
    write_pixels("colour.png", 1, PNG_FORMAT_RGB, {10, 20, 30});
    write_pixels("grey.png", 2, PNG_FORMAT_GRAY, {0, 200});
    write_pixels("leaf.png", 2, PNG_FORMAT_RGBA, {1, 2, 3, 0, 4, 5, 6, 255});
    using Texels = std::vector<std::array<std::uint8_t, 4>>;
    const auto texels_of = [&](const std::string &statements, bool cuts = true) {
        write("scan.mtl", "newmtl a\nKd 1 0 0\n" + statements);
        const Surface s = read("scan.obj");
        EXPECT_EQ(s.textures.size(), 1U) << statements;
        if (s.textures.size() != 1)
            return Texels{};
        EXPECT_EQ(s.textures[0].use.least_opacity, cuts ? kUsualAlphaCutoff : 0.0F) << statements;
        EXPECT_EQ(s.textures[0].use.is_blended, cuts) << statements;
        return s.textures[0].texels;
    };
    const Texels leaf{{1, 2, 3, 0}, {4, 5, 6, 255}};
    EXPECT_EQ(texels_of("map_Kd leaf.png\nmap_d leaf.png\n"), leaf);
    EXPECT_EQ(texels_of("map_Kd leaf.png\nmap_Tr leaf.png\n"), (Texels{{1, 2, 3, 255}, {4, 5, 6, 0}}));
    // The brightness of an image without opacity; the larger size.
    EXPECT_EQ(texels_of("map_Kd colour.png\nmap_d grey.png\n"), (Texels{{10, 20, 30, 0}, {10, 20, 30, 200}}));
    EXPECT_EQ(texels_of("map_d leaf.png\nmap_Kd colour.png\n"), (Texels{{10, 20, 30, 0}, {10, 20, 30, 255}}));
    EXPECT_EQ(texels_of("map_d grey.png\n"), (Texels{{255, 0, 0, 0}, {255, 0, 0, 200}}));
    // What says nothing.
    EXPECT_EQ(texels_of("map_Kd leaf.png\n", false), leaf);
    EXPECT_EQ(texels_of("map_Kd colour.png\nmap_d colour.png\n", false), (Texels{{10, 20, 30, 255}}));
    EXPECT_EQ(texels_of("map_Kd colour.png\nmap_d none.png\n", false), (Texels{{10, 20, 30, 255}}));
    EXPECT_EQ(texels_of("map_Kd colour.png\nmap_d -s 2 2 grey.png\n", false), (Texels{{10, 20, 30, 255}}));
    EXPECT_EQ(note_of(read("scan.obj"), "map_d of materials"), "dropped: it does not lie as map_Kd does");

    write("scan.mtl", "newmtl a\nd 0.25\nmap_Kd leaf.png\nmap_d leaf.png\n");
    EXPECT_EQ(read("scan.obj").textures[0].use.opacity, 0.25F);
    EXPECT_EQ(further("scan.obj"), (std::vector<std::string>{"scan.mtl", "leaf.png", "leaf.png"}));
}

TEST_F(ImageInputs, DamagedImagesAreDroppedAndStrictRefuses) {
    write("scan.mtl", "newmtl a\nmap_Kd a.png\n");
    write("scan.obj", "mtllib scan.mtl\nusemtl a\n" + kQuad + "f 1/1 2/2 3/3\n");
    write_png("a.png", 10);
    const auto size = std::filesystem::file_size(path("a.png"));
    std::filesystem::resize_file(path("a.png"), size - 1);
    const Surface s = read("scan.obj");
    EXPECT_TRUE(s.textures.empty() && s.texture_ids.empty());
    EXPECT_TRUE(note_of(s, "texture image 'a.png'").starts_with("dropped: the image is damaged or cut short"));
    EXPECT_EQ(note_of(s, "texture coordinates"), "dropped: no image belongs to them");
    const Result<Surface> strict = read_surface(path("scan.obj"), {.strict = true, .progress = {}});
    ASSERT_FALSE(strict.ok());
    EXPECT_EQ(strict.error().code, ErrorCode::bad_input);
}

TEST_F(ImageInputs, NamesOfOtherSystemsAreFound) {
    write("Skins/Wood.JPG", "x");
    write("both.png", "x");
    write("Both.png", "x");
    const std::string scan = path("scan.obj");
    EXPECT_EQ(find_beside(scan, "Skins/Wood.JPG"), path("Skins/Wood.JPG"));
    EXPECT_EQ(find_beside(scan, "skins\\wood.jpg"), path("Skins/Wood.JPG"));
    EXPECT_EQ(find_beside(scan, "both.png"), path("both.png"));
    EXPECT_EQ(find_beside(scan, "BOTH.PNG"), path("Both.png"));
    EXPECT_EQ(find_beside(scan, "C:\\scans\\2019\\both.png"), path("both.png"));
    EXPECT_EQ(find_beside(scan, "Skins"), std::nullopt);
    EXPECT_EQ(find_beside(scan, "none.png"), std::nullopt);
    EXPECT_EQ(find_beside(scan, ""), std::nullopt);
}

TEST_F(ImageInputs, NamesInOtherSpellingsAreFound) {
    write("h\u00FClle.png", "x");   // one character
    write("Bra\u0301s.png", "x");   // a letter and its mark
    write("\u304C\uAC01.png", "x"); // Japanese and Korean
    write("it's \"me\".png", "x");
    const std::string scan = path("scan.obj");
    EXPECT_EQ(find_beside(scan, "hu\u0308lle.png"), path("h\u00FClle.png"));
    EXPECT_EQ(find_beside(scan, "h\xFClle.PNG"), path("h\u00FClle.png")); // Latin-1
    EXPECT_EQ(find_beside(scan, "br\u00E1s.png"), path("Bra\u0301s.png"));
    EXPECT_EQ(find_beside(scan, "\u304B\u3099\u1100\u1161\u11A8.png"), path("\u304C\uAC01.png"));
    EXPECT_EQ(find_beside(scan, "\"h\u00FClle.png\""), path("h\u00FClle.png"));
    EXPECT_EQ(find_beside(scan, "'h\u00FClle.png'"), path("h\u00FClle.png"));
    EXPECT_EQ(find_beside(scan, "it's \"me\".png"), path("it's \"me\".png"));
    EXPECT_TRUE(why_missing("skin.<UDIM>.png").find("UDIM") != std::string::npos);
}

TEST_F(ImageInputs, KeywordsOfMaterialsHaveAnyLetterCaseAndNamesHaveQuotes) {
    write("scan.mtl", "NEWMTL a\nkd 0 1 0\nMap_KD 'a.png'\n");
    write_png("a.png", 10);
    write("scan.obj", "mtllib \"scan.mtl\"\nusemtl A\n" + kQuad + "f 1/1 2/2 3/3\n");
    const Surface s = read("scan.obj");
    ASSERT_EQ(s.textures.size(), 1U);
    EXPECT_EQ(s.textures[0].texels[0][0], 10);
    EXPECT_EQ(note_of(s, "Kd of materials"), "their colours, sRGB, 8 bits");
}

TEST_F(ImageInputs, AFileThatStandsForAnImageIsNamed) {
    write("scan.mtl", "newmtl a\nmap_Kd a.png\n");
    write("a.png", "version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 1\n");
    write("scan.obj", "mtllib scan.mtl\nusemtl a\n" + kQuad + "f 1/1 2/2 3/3\n");
    EXPECT_TRUE(
        note_of(read("scan.obj"), "texture image 'a.png'").starts_with("dropped: the file is a pointer of Git"));
}

TEST(ReadImage, SixteenBitsWithoutAGammaAreSrgb) {
    const std::array<std::uint16_t, 3> pixel{220 * 257, 30 * 257, 30 * 257 + 100};
    const Result<Texture> png = read_image(test::png16_of(1, 1, pixel.data()));
    ASSERT_TRUE(png.ok()) << png.error().message;
    EXPECT_EQ(png->texels[0], (std::array<std::uint8_t, 4>{220, 30, 30, 255}));
}

TEST(ReadImage, StrayBytesOfAJpegAreNoDamage) {
    const Bytes jpeg = test::jpeg_of(16, 8, 3, false, Bytes(16 * 8 * 3, 90));
    Bytes stray = jpeg, cut(jpeg.begin(), jpeg.end() - 20);
    stray.insert(stray.end() - 2, 258, 0); // in front of the marker of the end
    const Result<Texture> read = read_image(stray);
    ASSERT_TRUE(read.ok()) << read.error().message;
    EXPECT_EQ(read->texels[100], (std::array<std::uint8_t, 4>{90, 90, 90, 255}));
    EXPECT_TRUE(read->has_stray_bytes);
    EXPECT_FALSE(read_image(jpeg)->has_stray_bytes);
    EXPECT_FALSE(read_image(cut).ok());
}

TEST(ReadImage, FormatsAndOpacity) {
    const std::vector<std::uint8_t> rgba{1, 2, 3, 4, 5, 6, 7, 255};
    const Result<Texture> png = read_image(test::png_of(2, 1, PNG_FORMAT_RGBA, rgba.data()));
    ASSERT_TRUE(png.ok());
    EXPECT_EQ(png->texels[1], (std::array<std::uint8_t, 4>{5, 6, 7, 255}));
    EXPECT_EQ(png->texels[0][3], 4);
    const Result<Texture> jpeg = read_image(test::jpeg_of(16, 8, 3, false, Bytes(16 * 8 * 3, 90)));
    ASSERT_TRUE(jpeg.ok());
    EXPECT_EQ(jpeg->texels[100], (std::array<std::uint8_t, 4>{90, 90, 90, 255}));
    std::uint8_t *made = nullptr;
    const std::vector<std::uint8_t> rgb{1, 2, 3, 200, 100, 50};
    const std::size_t size = WebPEncodeLosslessRGB(rgb.data(), 2, 1, 6, &made);
    const Bytes webp(made, made + size);
    WebPFree(made);
    const Result<Texture> decoded = read_image(webp);
    ASSERT_TRUE(decoded.ok()) << decoded.error().message;
    EXPECT_EQ(decoded->texels[1], (std::array<std::uint8_t, 4>{200, 100, 50, 255}));
    EXPECT_FALSE(read_image(ByteView(webp).first(18)).ok());
    EXPECT_EQ(read_image(Bytes{'G', 'I', 'F'}).error().code, ErrorCode::bad_input);
}

} // namespace
