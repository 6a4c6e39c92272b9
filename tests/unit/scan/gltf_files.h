// glTF files that tests write.
#pragma once

#include "unit/scan/readings.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <string>
#include <vector>

namespace pbm::test {

using nlohmann::json;

// A GLB under construction: arrays become buffer views and accessors.
class Glb {
  public:
    json doc = {{"asset", {{"version", "2.0"}}}};

    template <class T> std::size_t view(const std::vector<T> &values, std::size_t stride = 0) {
        while (binary_.size() % 4 != 0)
            binary_ += '\0';
        json described{{"buffer", 0}, {"byteOffset", binary_.size()}, {"byteLength", values.size() * sizeof(T)}};
        if (stride != 0)
            described["byteStride"] = stride;
        binary_.append(reinterpret_cast<const char *>(values.data()), values.size() * sizeof(T));
        doc["bufferViews"].push_back(described);
        return doc["bufferViews"].size() - 1;
    }
    std::size_t accessor(json described) {
        doc["accessors"].push_back(std::move(described));
        return doc["accessors"].size() - 1;
    }
    std::size_t floats(const std::vector<float> &values, const char *type, std::size_t components) {
        return accessor({{"bufferView", view(values)},
                         {"componentType", 5126},
                         {"count", values.size() / components},
                         {"type", type}});
    }
    std::size_t indices(const std::vector<std::uint16_t> &values) {
        return accessor(
            {{"bufferView", view(values)}, {"componentType", 5123}, {"count", values.size()}, {"type", "SCALAR"}});
    }
    // A mesh of these primitives, shown by a node.
    void show(json primitives, json node = json::object()) {
        doc["meshes"].push_back({{"primitives", std::move(primitives)}});
        node["mesh"] = doc["meshes"].size() - 1;
        doc["nodes"].push_back(std::move(node));
        doc["scenes"][0]["nodes"].push_back(doc["nodes"].size() - 1);
    }
    const std::string &binary() const { return binary_; }
    std::string file() const {
        json whole = doc;
        if (!whole.contains("buffers"))
            whole["buffers"].push_back({{"byteLength", binary_.size()}});
        std::string text = whole.dump(), binary = binary_;
        text.resize((text.size() + 3) / 4 * 4, ' ');
        binary.resize((binary.size() + 3) / 4 * 4, '\0');
        const auto word = [](std::size_t value) {
            const auto bits = static_cast<std::uint32_t>(value);
            return std::string(reinterpret_cast<const char *>(&bits), 4);
        };
        return "glTF" + word(2) + word(28 + text.size() + binary.size()) + word(text.size()) + "JSON" + text +
               word(binary.size()) + std::string("BIN\0", 4) + binary;
    }

  private:
    std::string binary_;
};

inline build::Surface surface(const Glb &glb) { return surface(glb.file(), "scan.glb"); }
inline std::string refusal(const Glb &glb) { return error(glb.file(), "scan.glb").message; }
// Whether the report has a line of this name and fate.
inline bool says(const build::Surface &s, const std::string &name, Fate fate) {
    return std::any_of(s.report.begin(), s.report.end(),
                       [&](const AttributeReport &line) { return line.name == name && line.fate == fate; });
}

inline const std::vector<float> kSquare{0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};

} // namespace pbm::test
