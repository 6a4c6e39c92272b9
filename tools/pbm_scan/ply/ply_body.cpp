#include "pbm_scan/ply/ply_body.h"

#include "pbm_scan/conventions/colour_range.h"
#include "pbm_scan/ply/ply_columns.h"
#include "pbm_scan/ply/ply_damage.h"
#include "pbm_scan/ply/ply_source.h"
#include "pbm_scan/surface/polygon.h"
#include "pbm_scan/surface/range_grid.h"
#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/printable.h"

#include <algorithm>
#include <cassert>
#include <limits>
#include <optional>
#include <utility>

namespace pbm::build {
namespace {

constexpr auto kNoScalars = [](std::size_t, double) {};
constexpr auto kNoLists = [](const PlyProperty &) { return true; };
constexpr std::size_t kRowsPerBlock = 4096; // gathered column by column: a block fits the cache

// Layout of face rows that the fast path reads: one list of 32-bit corners with a length of one byte, and unused
// scalars.
struct TriangleRows {
    bool possible = false;
    std::size_t before = 0; // bytes in front of the list's length
    std::size_t size = 0;   // of the row of a triangle
};

TriangleRows triangle_rows(const PlyElement &element) {
    TriangleRows rows{.possible = true};
    for (const PlyProperty &property : element.properties) {
        const bool corners = property.role == PlyRole::corners;
        if (corners) {
            rows.possible = rows.possible && size_of(property.count_type) == 1 && size_of(property.type) == 4 &&
                            !is_float(property.type);
            rows.before = rows.size;
            rows.size += 13;
        } else {
            rows.possible = rows.possible && !property.is_list && property.role == PlyRole::none;
            rows.size += size_of(property.type);
        }
    }
    return rows;
}

template <class Source> class BodyReader {
  public:
    BodyReader(std::span<const std::uint8_t> bytes, const PlyHeader &header, const PlyRoles &roles,
               const ReadOptions &options, Source source)
        : bytes_(bytes), header_(header), roles_(roles), options_(options), in_(std::move(source)) {}

    Result<PlyBody> read() {
        if (const Status status = check_counts(); !status)
            return status.error();
        allocate_vertices();
        for (const PlyElement &element : header_.elements) {
            if (!element.properties.empty() && !read_element(element))
                return error(element);
            if (element.kind == PlyKind::vertex) {
                has_vertices_ = true;
                if constexpr (!Source::kIsText) {
                    if (const std::optional<Error> wrong = wrong_byte_order(body_.positions, header_, roles_))
                        return *wrong;
                    in_.order_is_open = !is_float(roles_.position[0]->type);
                }
            }
        }
        triangulate_waiting();
        body_.end_offset = bytes_.size() - in_.left();
        return std::move(body_);
    }

  private:
    Status check_counts() {
        std::uint64_t left = in_.left() + (Source::kIsText ? 1 : 0); // the last line may lack its end
        for (const PlyElement &element : header_.elements) {
            const std::uint64_t least = min_row_size(element, Source::kIsText);
            if (least != 0 && element.count > left / least)
                return bad_input(
                    in_line(element) + "element " + printable_in_quotes(element.name) + " announces " +
                        std::to_string(element.count) + " rows, but the rest of the file can hold at most " +
                        std::to_string(left / least) + ": it is cut short or damaged; copy or export it again",
                    element.offset);
            left -= element.count * least;
            if (element.kind == PlyKind::vertex)
                vertex_count_ = element.count;
            if (element.kind == PlyKind::vertex && element.count > kMaxPlyVertices)
                return too_large(in_line(element) + "more than 2^32 - 2 vertices; split the scan", element.offset);
            if (element.kind == PlyKind::material && element.count > kMaxPlyMaterials)
                return too_large(in_line(element) + std::to_string(element.count) +
                                     " materials, but a model has at most 8; merge some",
                                 element.offset);
        }
        return {};
    }

    void allocate_vertices() {
        const auto count = static_cast<std::size_t>(vertex_count_);
        const auto allocate = [count](auto &values, const PlyProperty *property) {
            if (property != nullptr)
                values.resize(count);
        };
        body_.positions.resize(count);
        allocate(body_.normals, roles_.normal[0]);
        const auto is_byte = [](const PlyProperty *channel) {
            return channel != nullptr && channel->type == PlyScalar::uint8;
        };
        if (std::all_of(roles_.colour.begin(), roles_.colour.end(), is_byte))
            body_.colours.resize(count);
        else
            allocate(body_.wide_colours, roles_.colour[0]);
        allocate(body_.radii, roles_.radius);
        allocate(body_.material_ids, roles_.material_index);
        for (std::size_t i = 0; i < roles_.bytes.size(); ++i)
            allocate(body_.bytes[i], roles_.bytes[i]);
        for (std::size_t i = 0; i < roles_.splat.size(); ++i)
            if (roles_.splat[i] != nullptr && roles_.splat[i]->role == PlyRole::splat)
                body_.splat[i].resize(count);
        body_.fields.resize(roles_.fields.size());
        for (std::vector<double> &field : body_.fields)
            field.resize(count);
        allocate(body_.places, roles_.place[0]);
        allocate(place_of_, roles_.corner_places);
    }

    Column column(const PlyProperty &property) {
        const auto place = [&property](auto &values, Column::Kind kind, std::size_t size, PlyRole first) {
            const auto part = static_cast<std::size_t>(property.role) - static_cast<std::size_t>(first);
            return Column{kind, reinterpret_cast<std::uint8_t *>(values.data()) + part * size, sizeof values[0]};
        };
        const PlyRole role = property.role;
        if (role >= PlyRole::x && role <= PlyRole::z)
            return place(body_.positions, Column::Kind::float64, 8, PlyRole::x);
        if (role >= PlyRole::nx && role <= PlyRole::nz)
            return place(body_.normals, Column::Kind::float32, 4, PlyRole::nx);
        if (role >= PlyRole::red && role <= PlyRole::blue)
            return body_.wide_colours.empty() ? place(body_.colours, Column::Kind::uint8, 1, PlyRole::red)
                                              : place(body_.wide_colours, Column::Kind::float32, 4, PlyRole::red);
        if (role == PlyRole::radius)
            return place(body_.radii, Column::Kind::float32, 4, role);
        if (role == PlyRole::material_index)
            return place(body_.material_ids, Column::Kind::float32, 4, role);
        if (role == PlyRole::u || role == PlyRole::v)
            return place(body_.places, Column::Kind::float32, 4, PlyRole::u);
        if (role == PlyRole::field)
            return place(body_.fields[roles_.field_number(property)], Column::Kind::float64, 8, role);
        if (role == PlyRole::splat)
            return place(body_.splat[roles_.splat_number(property)], Column::Kind::float32, 4, role);
        if (role == PlyRole::byte)
            return place(body_.bytes[roles_.byte_attribute(property)], Column::Kind::uint8, 1, role);
        return {};
    }

    Error error(const PlyElement &element) const {
        std::string where = in_.place() + ": " + printable(element.name) + " " + std::to_string(row_);
        if (property_ != nullptr)
            where.append(", ").append(printable(property_->name));
        return bad_input(where + ": " + in_.fault + "; copy or export the scan again", in_.offset);
    }

    bool read_element(const PlyElement &element) {
        row_ = 0;
        switch (element.kind) {
        case PlyKind::vertex: return read_vertex(element);
        case PlyKind::face: return read_face(element);
        case PlyKind::tristrips: return read_strips(element);
        case PlyKind::range_grid: return read_range_grid(element);
        case PlyKind::material: return read_material(element);
        case PlyKind::skipped: break; // none of its properties has a role
        }
        if constexpr (!Source::kIsText)
            if (!has_lists(element)) // check_counts has verified that the product fits the file
                return in_.skip(static_cast<std::size_t>(element.count) * min_row_size(element, false));
        return read_rows(element, kNoScalars, kNoLists);
    }

    bool read_vertex(const PlyElement &element) {
        std::vector<Column> columns;
        for (const PlyProperty &property : element.properties)
            columns.push_back(column(property));
        if constexpr (!Source::kIsText) {
            if (!has_lists(element)) {
                const std::size_t row_size = min_row_size(element, false);
                while (row_ < element.count) {
                    const std::size_t rows = std::min<std::size_t>(kRowsPerBlock, element.count - row_);
                    std::size_t at = 0;
                    // Lists in an earlier element may have left fewer bytes than check_counts assumed.
                    if (in_.left() / row_size < rows) {
                        row_ += in_.left() / row_size;
                        in_.skip(in_.left() / row_size * row_size);
                        return in_.skip(in_.left() + 1);
                    }
                    for (std::size_t k = 0; k < columns.size(); ++k) {
                        const PlyScalar type = element.properties[k].type;
                        if (columns[k].kind != Column::Kind::none)
                            gather<Source::kSwap>(in_.data() + at, type, row_size, rows, columns[k], row_);
                        at += size_of(type);
                    }
                    in_.skip(rows * row_size);
                    row_ += rows;
                    if (row_ % 65536 == 0)
                        report_progress();
                }
                return true;
            }
        }
        const auto scalar = [&](std::size_t k, double value) { set_value(columns[k], row_, value); };
        return read_rows(element, scalar, kNoLists);
    }

    bool read_face(const PlyElement &element) {
        const TriangleRows rows = triangle_rows(element);
        glm::vec3 colour(0.0F);
        const auto scalar = [&](std::size_t k, double value) {
            const PlyRole role = element.properties[k].role;
            if (role >= PlyRole::red && role <= PlyRole::blue)
                colour[static_cast<int>(role) - static_cast<int>(PlyRole::red)] = static_cast<float>(value);
            else if (role == PlyRole::image)
                image_ = value >= 0 && value < Surface::kNoTexture ? static_cast<std::int32_t>(value) : -1;
        };
        const auto list = [&](const PlyProperty &property) {
            if (property.role == PlyRole::corner_places)
                return read_places(property);
            corners_.clear();
            return read_indices(property, 0,
                                [&](std::int64_t index) { corners_.push_back(static_cast<std::uint32_t>(index)); });
        };
        // Bounded by a small multiple of the file's size, since a triangle takes at least four numbers.
        const std::size_t least = Source::kIsText ? 8 : rows.size;
        body_.triangles.reserve(body_.triangles.size() + std::min<std::size_t>(element.count, in_.left() / least + 1));
        constexpr std::size_t kFirstBlock = 8;
        std::size_t block = kFirstBlock; // grows while all rows are triangles, so that a short run costs little
        while (row_ < element.count) {
            if (rows.possible) {
                const std::size_t most = std::min<std::size_t>(block, element.count - row_);
                const std::size_t done = read_triangle_rows(rows, most);
                row_ += done;
                block = done == most ? std::min(2 * block, kRowsPerBlock) : kFirstBlock;
                if (done == most)
                    continue;
            }
            if (!read_row(element, scalar, list))
                return false;
            add_polygon(colour);
            ++row_;
        }
        return true;
    }

    bool read_strips(const PlyElement &element) {
        const auto list = [&](const PlyProperty &property) {
            corners_.clear(); // since the last restart
            return read_indices(property, -1, [&](std::int64_t index) {
                if (index < 0)
                    return corners_.clear();
                corners_.push_back(static_cast<std::uint32_t>(index));
                const std::size_t n = corners_.size();
                if (n >= 3) {
                    const bool odd = n % 2 == 0; // every other triangle of a strip is wound the other way
                    add_triangle(corners_[odd ? n - 2 : n - 3], corners_[odd ? n - 3 : n - 2], corners_[n - 1], false);
                }
            });
        };
        return read_rows(element, kNoScalars, list);
    }

    bool read_range_grid(const PlyElement &element) {
        body_.grid_cells.assign(static_cast<std::size_t>(element.count),
                                kEmptyCell); // check_counts: a byte each at least
        const auto list = [&](const PlyProperty &property) {
            std::size_t length = 0;
            if (!in_.begin_list(property, length))
                return false;
            if (length > 1) {
                in_.fault = "a cell of a range grid holds one vertex or none, this one " + std::to_string(length);
                return false;
            }
            std::int64_t index = 0;
            if (length == 1 && !read_index(property.type, 0, index))
                return false;
            if (length == 1)
                body_.grid_cells[row_] = static_cast<std::uint32_t>(index);
            return true;
        };
        return read_rows(element, kNoScalars, list);
    }

    bool read_material(const PlyElement &element) {
        for (; row_ < element.count; ++row_) {
            std::array<double, 10> values{};
            values.fill(std::numeric_limits<double>::quiet_NaN());
            const auto scalar = [&](std::size_t k, double value) {
                const PlyRole role = element.properties[k].role;
                if (role >= PlyRole::ka && role <= PlyRole::tint)
                    values[static_cast<std::size_t>(role) - static_cast<std::size_t>(PlyRole::ka)] = value;
            };
            if (!read_row(element, scalar, kNoLists))
                return false;
            body_.materials.push_back(values);
        }
        return true;
    }

    // u v of the corners of a face.
    bool read_places(const PlyProperty &property) {
        std::size_t length = 0;
        if (!in_.begin_list(property, length))
            return false;
        corner_places_.clear();
        double value = 0;
        for (; length > 0 && in_.number(property.type, value); --length)
            corner_places_.push_back(static_cast<float>(value));
        return length == 0;
    }

    bool skip_list(const PlyProperty &property) {
        std::size_t length = 0;
        if (!in_.begin_list(property, length))
            return false;
        if constexpr (Source::kIsText) {
            double ignored = 0;
            for (std::size_t i = 0; i < length; ++i)
                if (!in_.number(property.type, ignored))
                    return false;
            return true;
        } else {
            return in_.skip(length * size_of(property.type));
        }
    }

    // An index of a vertex, or a negative value down to `least`.
    bool read_index(PlyScalar type, std::int64_t least, std::int64_t &index) {
        double value = 0;
        if (!in_.number(type, value))
            return false;
        if (value >= static_cast<double>(least) && value < static_cast<double>(vertex_count_)) {
            index = static_cast<std::int64_t>(value);
            if (static_cast<double>(index) == value)
                return true;
        }
        if constexpr (!Source::kIsText)
            in_.offset -= size_of(type);
        const bool whole = value >= -2147483648.0 && value <= 4294967295.0;
        in_.fault =
            "vertex index " + number_text(value) + ", but there are " + std::to_string(vertex_count_) + " vertices";
        if constexpr (!Source::kIsText)
            if (in_.order_is_open && whole && size_of(type) == 4 &&
                __builtin_bswap32(static_cast<std::uint32_t>(static_cast<std::int64_t>(value))) < vertex_count_)
                in_.fault += Source::kOtherOrder;
        return false;
    }

    // Reads rows while they are triangles with three different corners in range. The general reader handles the row
    // that ends the run, and its errors.
    std::size_t read_triangle_rows(const TriangleRows &rows, std::size_t most) {
        if constexpr (Source::kIsText) {
            return 0;
        } else {
            most = std::min(most, in_.left() / rows.size);
            const std::size_t old_size = body_.triangles.size();
            body_.triangles.resize(old_size + most);
            glm::uvec3 *out = body_.triangles.data() + old_size;
            const std::uint8_t *row = in_.data() + rows.before;
            const auto limit = static_cast<std::uint32_t>(vertex_count_);
            std::size_t done = 0;
            for (; done < most; ++done, row += rows.size) {
                const auto a = load_scalar<std::uint32_t, Source::kSwap>(row + 1);
                const auto b = load_scalar<std::uint32_t, Source::kSwap>(row + 5);
                const auto c = load_scalar<std::uint32_t, Source::kSwap>(row + 9);
                if (row[0] != 3 || std::max(a, std::max(b, c)) >= limit || a == b || b == c || a == c)
                    break;
                out[done] = {a, b, c};
            }
            body_.triangles.resize(old_size + done);
            in_.skip(done * rows.size);
            return done;
        }
    }

    void add_triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c, bool count_degenerate) {
        if (a != b && b != c && a != c)
            body_.triangles.emplace_back(a, b, c);
        else if (count_degenerate)
            ++body_.degenerate_triangles;
    }

    void add_polygon(const glm::vec3 &colour) {
        const std::size_t before = body_.triangles.size();
        if (corners_.size() == 3) {
            add_triangle(corners_[0], corners_[1], corners_[2], true);
        } else if (has_vertices_ || corners_.size() < 3) {
            body_.degenerate_triangles += triangulator_.triangulate(corners_, body_.positions, body_.triangles);
        } else {
            waiting_.push_back({body_.triangles.size(), corners_.size(), colour});
            waiting_corners_.insert(waiting_corners_.end(), corners_.begin(), corners_.end());
        }
        if (roles_.face_colour[0] != nullptr) {
            if (body_.face_colours.size() < before)
                body_.face_colours.resize(before, kNoColour);
            body_.face_colours.insert(body_.face_colours.end(), body_.triangles.size() - before, colour);
        }
        if (roles_.corner_places != nullptr || roles_.image != nullptr)
            add_places(before);
    }

    // Of the triangles of the current face, from `first` on.
    void add_places(std::size_t first) {
        const bool has_places = corner_places_.size() == 2 * corners_.size();
        if (has_places)
            for (std::size_t i = 0; i < corners_.size(); ++i)
                place_of_[corners_[i]] = {corner_places_[2 * i], corner_places_[2 * i + 1]};
        for (std::size_t i = first; i < body_.triangles.size(); ++i) {
            const glm::uvec3 &t = body_.triangles[i];
            if (roles_.corner_places != nullptr)
                body_.corner_places.push_back(
                    has_places ? TextureCorners{place_of_[t.x], place_of_[t.y], place_of_[t.z]} : TextureCorners{});
            const std::int32_t image = roles_.image != nullptr ? image_ : 0;
            body_.images.push_back(has_places || roles_.corner_places == nullptr ? image : -1);
        }
    }

    // Triangulates in the order of the faces, so that the result does not depend on the order of the elements.
    void triangulate_waiting() {
        if (roles_.face_colour[0] != nullptr)
            body_.face_colours.resize(body_.triangles.size(), kNoColour);
        if (waiting_.empty())
            return;
        const std::vector<glm::uvec3> others = std::exchange(body_.triangles, {});
        const std::vector<glm::vec3> other_colours = std::exchange(body_.face_colours, {});
        std::size_t taken = 0, corner = 0;
        const auto take_until = [&](std::size_t end) {
            const auto append = [&](auto &to, const auto &from) {
                if (!from.empty())
                    to.insert(to.end(), from.begin() + static_cast<std::ptrdiff_t>(taken),
                              from.begin() + static_cast<std::ptrdiff_t>(end));
            };
            append(body_.triangles, others);
            append(body_.face_colours, other_colours);
            taken = end;
        };
        for (const WaitingPolygon &polygon : waiting_) {
            take_until(polygon.triangles_before);
            body_.degenerate_triangles += triangulator_.triangulate(
                std::span(waiting_corners_).subspan(corner, polygon.corners), body_.positions, body_.triangles);
            corner += polygon.corners;
            if (roles_.face_colour[0] != nullptr)
                body_.face_colours.resize(body_.triangles.size(), polygon.colour);
        }
        take_until(others.size());
    }

    // Reads one row; `scalar` gets the value of every property that is no list, `list` the lists that have a role.
    template <class ScalarUse, class ListUse> bool read_row(const PlyElement &element, ScalarUse scalar, ListUse list) {
        for (std::size_t k = 0; k < element.properties.size(); ++k) {
            const PlyProperty &property = element.properties[k];
            property_ = &property;
            if (property.is_list) {
                if (property.role == PlyRole::none ? !skip_list(property) : !list(property))
                    return false;
                continue;
            }
            double value = 0;
            if (!in_.number(property.type, value))
                return false;
            scalar(k, value);
        }
        property_ = nullptr;
        if (row_ % 65536 == 65535)
            report_progress();
        return in_.end_row();
    }

    template <class ScalarUse, class ListUse>
    bool read_rows(const PlyElement &element, ScalarUse scalar, ListUse list) {
        while (row_ < element.count && read_row(element, scalar, list))
            ++row_;
        return row_ == element.count;
    }
    // Calls `use` with each index of the current list.
    template <class Use> bool read_indices(const PlyProperty &property, std::int64_t least, Use use) {
        std::size_t length = 0;
        std::int64_t index = 0;
        if (!in_.begin_list(property, length))
            return false;
        for (; length > 0 && read_index(property.type, least, index); --length)
            use(index);
        return length == 0;
    }

    void report_progress() {
        if (options_.progress && !bytes_.empty())
            options_.progress(1.0 - static_cast<double>(in_.left()) / static_cast<double>(bytes_.size()));
    }

    std::span<const std::uint8_t> bytes_;
    const PlyHeader &header_;
    const PlyRoles &roles_;
    const ReadOptions &options_;
    Source in_;
    PlyBody body_;
    std::uint64_t vertex_count_ = 0;
    bool has_vertices_ = false;          // their element has been read
    std::vector<std::uint32_t> corners_; // of the current face
    std::vector<float> corner_places_;   // of the current face: u v of each
    std::int32_t image_ = 0;             // of the current face
    std::vector<glm::vec2> place_of_;    // [vertices] in the current face
    PolygonTriangulator triangulator_;
    // Polygons of more than three corners that precede the vertices, and their concatenated corners.
    struct WaitingPolygon {
        std::size_t triangles_before, corners;
        glm::vec3 colour;
    };
    std::vector<WaitingPolygon> waiting_;
    std::vector<std::uint32_t> waiting_corners_;
    std::size_t row_ = 0; // the current row, for messages
    const PlyProperty *property_ = nullptr;
};

} // namespace

Result<PlyBody> read_ply_body(std::span<const std::uint8_t> bytes, const PlyHeader &header, const PlyRoles &roles,
                              const ReadOptions &options) {
    assert(header.body_offset <= bytes.size());
    const auto read = [&](auto source) { return BodyReader(bytes, header, roles, options, std::move(source)).read(); };
    if (header.encoding == PlyEncoding::ascii)
        return read(AsciiSource(bytes, header.body_offset, header.body_line));
    constexpr bool kLittleHost = std::endian::native == std::endian::little;
    if ((header.encoding == PlyEncoding::little_endian) == kLittleHost)
        return read(BinarySource<false>(bytes, header.body_offset));
    return read(BinarySource<true>(bytes, header.body_offset));
}

} // namespace pbm::build
