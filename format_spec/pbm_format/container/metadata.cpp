// Checks and lists metadata. The only code of the format library that parses JSON.
#include "pbm_format/container/layout.h"
#include "pbm_format/law/catalogue.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <set>

namespace pbm {

namespace {

// A JSON handler that stores no values: the library's values allocate memory in their destructors, where an allocation
// failure cannot be reported.
class Onlooker : public nlohmann::json_sax<nlohmann::json> {
  public:
    bool null() override { return true; }
    bool boolean(bool) override { return true; }
    bool number_integer(number_integer_t) override { return true; }
    bool number_unsigned(number_unsigned_t) override { return true; }
    bool number_float(number_float_t, const string_t &) override { return true; }
    bool string(string_t &) override { return true; }
    bool binary(binary_t &) override { return true; }
    bool key(string_t &) override { return true; }
    bool start_object(std::size_t) override { return true; }
    bool start_array(std::size_t) override { return true; }
    bool end_object() override { return true; }
    bool end_array() override { return true; }
    bool parse_error(std::size_t, const std::string &, const nlohmann::detail::exception &) override { return false; }
};

class Shape : public Onlooker {
  public:
    bool is_object() const { return object_; }
    bool is_too_deep() const { return too_deep_; }

    bool start_object(std::size_t) override {
        object_ |= depth_ == 0;
        return enter();
    }
    bool start_array(std::size_t) override { return enter(); }
    bool end_object() override { return --depth_, true; }
    bool end_array() override { return --depth_, true; }

  private:
    bool enter() {
        constexpr int kMaxNesting = 32;
        too_deep_ |= depth_ >= kMaxNesting;
        return ++depth_, true;
    }

    int depth_ = 0;
    bool object_ = false, too_deep_ = false;
};

class Members : public Onlooker {
  public:
    std::vector<MetadataMember> take() { return std::move(members_); }

    bool start_object(std::size_t) override {
        open_.emplace_back();
        return true;
    }
    bool end_object() override {
        open_.pop_back();
        return true;
    }
    bool key(string_t &key) override {
        members_.push_back({key, "", !open_.back().insert(key).second});
        return true;
    }
    bool string(string_t &text) override {
        if (!members_.empty())
            members_.back().text = text;
        return true;
    }

  private:
    std::vector<MetadataMember> members_;
    std::vector<std::set<std::string>> open_; // keys of the enclosing objects
};

} // namespace

Status check_metadata(ByteView bytes) {
    if (bytes.size() > kMaxMetadataBytes)
        return broken("3.3.1", 0, "metadata is longer than 4,096 bytes", kMaxMetadataBytes, bytes.size());
    // The library skips a byte order mark and takes a zero byte as the end; neither is valid JSON.
    const bool foreign =
        (!bytes.empty() && bytes[0] == 0xEF) || std::find(bytes.begin(), bytes.end(), 0) != bytes.end();
    Shape shape;
    const bool parsed = nlohmann::json::sax_parse(bytes.begin(), bytes.end(), &shape);
    if (!parsed || foreign || shape.is_too_deep())
        return broken("3.3.2", 0, "metadata is not JSON");
    if (!shape.is_object())
        return broken("3.3.3", 0, "metadata is not a JSON object");
    return {};
}

std::vector<MetadataMember> list_metadata(ByteView bytes) {
    Members members;
    const bool is_json = nlohmann::json::sax_parse(bytes.begin(), bytes.end(), &members);
    assert(is_json);
    static_cast<void>(is_json);
    return members.take();
}

} // namespace pbm
