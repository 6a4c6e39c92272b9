// The sheet that honest files hold, and how its numbers become text and bytes.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace pbm::mutants {

// A bent sheet: a grid of kEdge x kEdge vertices and its triangles.
inline constexpr int kEdge = 5;
inline constexpr int kVertices = kEdge * kEdge;

struct Vertex {
    float x, y, z;
};

inline Vertex vertex(int i) {
    const int column = i % kEdge, row = i / kEdge;
    return {static_cast<float>(column) * 0.25F, static_cast<float>(row) * 0.5F,
            static_cast<float>((column * column + 3 * row) % 7) * 0.125F};
}

using Triangle = std::array<int, 3>;

inline std::vector<Triangle> triangles() {
    std::vector<Triangle> all;
    for (int row = 0; row + 1 < kEdge; ++row)
        for (int column = 0; column + 1 < kEdge; ++column) {
            const int i = row * kEdge + column;
            all.push_back({i, i + 1, i + kEdge});
            all.push_back({i + 1, i + kEdge + 1, i + kEdge});
        }
    return all;
}

inline std::string number(float value) { // with few decimals
    std::string text = std::to_string(value);
    text.erase(text.find_last_not_of('0') + 1);
    return text + (text.back() == '.' ? "0" : "");
}

inline std::string place(int i) {
    const Vertex v = vertex(i);
    return number(v.x) + " " + number(v.y) + " " + number(v.z);
}

inline std::string corners(const Triangle &t, int first, std::string_view between = " ") {
    std::string text = std::to_string(t[0] + first);
    for (const std::size_t k : {1U, 2U})
        text.append(between).append(std::to_string(t[k] + first));
    return text;
}

template <class T> void append(std::string &to, T value, bool big_endian = false) {
    std::array<char, sizeof(T)> bytes{};
    std::memcpy(bytes.data(), &value, sizeof value);
    if (big_endian != (std::endian::native == std::endian::big))
        for (std::size_t i = 0; i < bytes.size() / 2; ++i)
            std::swap(bytes[i], bytes[bytes.size() - 1 - i]);
    to.append(bytes.data(), bytes.size());
}

} // namespace pbm::mutants
