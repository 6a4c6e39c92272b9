// Law: for any bytes, each check of OBJ, OFF and STL returns an Error of one line, or a text for OpenMesh with exactly
// the announced vertices and faces, numbers in the range of float, and valid indices.
#include "pbm_scan/mesh/mesh_text.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <string>

namespace {

using pbm::Result;
using pbm::build::MeshText;

void require(bool holds) {
    if (!holds)
        std::abort();
}

void hold_numbers(std::istringstream &words, int count) {
    std::string word;
    for (int i = 0; i < count; ++i) {
        require(static_cast<bool>(words >> word));
        char *end = nullptr;
        const float value = std::strtof(word.c_str(), &end);
        require(*end == '\0' && std::isfinite(value));
    }
}

void hold_obj(const MeshText &text) {
    std::istringstream lines(text.for_openmesh);
    std::uint64_t vertices = 0, normals = 0, faces = 0;
    std::int64_t highest = 0;
    for (std::string line; std::getline(lines, line);) {
        std::istringstream words(line);
        std::string word;
        if (!(words >> word))
            continue;
        require(word == "v" || word == "vn" || word == "f");
        if (word != "f") {
            ++(word == "v" ? vertices : normals);
            hold_numbers(words, 3);
            continue;
        }
        ++faces;
        std::size_t corners = 0;
        for (; words >> word; ++corners) {
            const std::int64_t index = std::atoll(word.c_str());
            require(index != 0 && (index > 0 || static_cast<std::uint64_t>(-index) <= vertices));
            highest = std::max(highest, index);
        }
        require(corners >= 3 && corners <= pbm::build::kMaxCorners);
    }
    require(vertices == text.vertices && faces == text.faces && highest <= static_cast<std::int64_t>(vertices));
}

void hold_off(const MeshText &text) {
    std::istringstream words(text.for_openmesh);
    std::string word;
    std::uint64_t vertices = 0, faces = 0, edges = 0;
    require(static_cast<bool>(words >> word >> vertices >> faces) && vertices == text.vertices && faces >= text.faces);
    words >> edges;
    hold_numbers(words, static_cast<int>(3 * vertices));
    for (std::uint64_t i = 0; i < faces; ++i) {
        std::uint64_t corners = 0, corner = 0;
        require(static_cast<bool>(words >> corners) && corners <= pbm::build::kMaxCorners);
        for (; corners != 0; --corners)
            require(static_cast<bool>(words >> corner) && corner < vertices);
    }
    require(!(words >> word));
}

void hold_stl(const MeshText &text) {
    if (text.binary) {
        std::uint32_t facets = 0;
        require(text.for_openmesh.size() >= 84);
        std::memcpy(&facets, text.for_openmesh.data() + 80, sizeof facets);
        require(facets == text.faces && text.for_openmesh.size() == 84 + 50 * text.faces);
        return;
    }
    std::istringstream words(text.for_openmesh);
    std::uint64_t facets = 0;
    for (std::string word; words >> word;)
        if (word == "facet") {
            ++facets;
        } else if (word == "vertex") {
            double low = 0, high = 0;
            require(static_cast<bool>(words >> low >> high) && low + 65536 * high < static_cast<double>(text.vertices));
        }
    require(facets == text.faces);
}

template <class Hold> void hold(const Result<MeshText> &result, std::size_t size, Hold &&hold_text) {
    if (!result) {
        require(!result.error().message.empty() && result.error().offset <= size);
        for (const char c : result.error().message)
            require(static_cast<unsigned char>(c) >= 0x20 && c != 0x7f);
        return;
    }
    const MeshText &text = *result;
    require(text.binary || text.positions.size() == text.vertices);
    require(text.colours.empty() || text.colours.size() == text.vertices);
    require(text.normals.empty() || text.normals.size() == text.vertices);
    require(text.vertices <= size && text.faces + text.dropped_triangles <= size && text.triangles <= size);
    hold_text(text);
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    hold(pbm::build::check_obj({data, size}), size, hold_obj);
    hold(pbm::build::check_off({data, size}), size, hold_off);
    hold(pbm::build::check_stl({data, size}), size, hold_stl);
    return 0;
}
