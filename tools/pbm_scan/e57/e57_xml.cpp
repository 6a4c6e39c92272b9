#include "pbm_scan/e57/e57_xml.h"

#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/printable.h"
#include "pbm_scan/text/text_number.h"
#include "pbm_scan/text/words.h"

#include <expat.h>

#include <algorithm>
#include <memory>

namespace pbm::build {
namespace {

class TreeBuilder {
  public:
    TreeBuilder(const E57Pages &pages) : pages_(pages), parser_(XML_ParserCreate("UTF-8"), &XML_ParserFree) {
        XML_SetUserData(parser_.get(), this);
        XML_SetElementHandler(parser_.get(), &begin, &end);
        XML_SetCharacterDataHandler(parser_.get(), &characters);
        XML_SetStartDoctypeDeclHandler(parser_.get(), &document_type);
    }

    Result<E57Xml> parse(std::span<const std::uint8_t> bytes) {
        const char *const text = reinterpret_cast<const char *>(bytes.data());
        const XML_Status status = XML_Parse(parser_.get(), text, static_cast<int>(bytes.size()), XML_TRUE);
        if (refusal_)
            return *refusal_;
        if (status != XML_STATUS_OK)
            return bad_input(std::string("the XML section is damaged: ") +
                                 XML_ErrorString(XML_GetErrorCode(parser_.get())) + " in its line " +
                                 std::to_string(XML_GetCurrentLineNumber(parser_.get())) + "; export the scan again",
                             offset());
        return std::move(xml_);
    }

  private:
    static TreeBuilder &self(void *user) { return *static_cast<TreeBuilder *>(user); }

    static void XMLCALL begin(void *user, const XML_Char *name, const XML_Char **attributes) {
        TreeBuilder &builder = self(user);
        if (builder.refusal_)
            return;
        std::vector<E57Element> &elements = builder.xml_.elements;
        if (elements.size() == kMaxE57Elements || builder.open_.size() == kMaxE57Depth)
            return builder.refuse(too_large(elements.size() == kMaxE57Elements
                                                ? "the XML section has more than 1048576 elements"
                                                : "the XML section has elements nested more than 64 deep",
                                            builder.offset()));
        const auto index = static_cast<std::uint32_t>(elements.size());
        if (!builder.open_.empty())
            elements[builder.open_.back()].children.push_back(index);
        builder.open_.push_back(index);
        E57Element &element = elements.emplace_back();
        element.name = name;
        element.offset = builder.offset();
        for (const XML_Char **pair = attributes; *pair != nullptr; pair += 2)
            element.attributes.emplace_back(pair[0], pair[1]);
    }
    static void XMLCALL end(void *user, const XML_Char * /*name*/) {
        if (TreeBuilder &builder = self(user); !builder.refusal_)
            builder.open_.pop_back();
    }
    static void XMLCALL characters(void *user, const XML_Char *text, int length) {
        if (TreeBuilder &builder = self(user); !builder.refusal_ && !builder.open_.empty())
            builder.xml_.elements[builder.open_.back()].text.append(text, static_cast<std::size_t>(length));
    }
    static void XMLCALL document_type(void *user, const XML_Char * /*name*/, const XML_Char * /*system*/,
                                      const XML_Char * /*public_id*/, int /*has_internal_subset*/) {
        TreeBuilder &builder = self(user);
        builder.refuse(bad_input("the XML section has a document type (DOCTYPE), which E57 does not allow; export the "
                                 "scan again",
                                 builder.offset()));
    }

    void refuse(Error error) {
        refusal_ = std::move(error);
        XML_StopParser(parser_.get(), XML_FALSE);
    }
    std::uint64_t offset() const {
        const XML_Index at = XML_GetCurrentByteIndex(parser_.get());
        return pages_.physical(pages_.xml().offset + static_cast<std::uint64_t>(std::max<XML_Index>(at, 0)));
    }

    const E57Pages &pages_;
    std::unique_ptr<XML_ParserStruct, decltype(&XML_ParserFree)> parser_;
    E57Xml xml_;
    std::vector<std::uint32_t> open_; // elements from the root to the current one
    std::optional<Error> refusal_;
};

} // namespace

std::optional<std::string_view> E57Element::attribute(std::string_view key) const {
    const auto found =
        std::find_if(attributes.begin(), attributes.end(), [&](const auto &a) { return a.first == key; });
    return found == attributes.end() ? std::nullopt : std::optional<std::string_view>(found->second);
}

const E57Element *E57Xml::child(const E57Element &parent, std::string_view name) const {
    for (const std::uint32_t index : parent.children)
        if (elements[index].name == name)
            return &elements[index];
    return nullptr;
}

Result<double> E57Xml::number(const E57Element &parent, std::string_view name, double otherwise) const {
    const E57Element *const element = child(parent, name);
    if (element == nullptr)
        return otherwise;
    const std::string_view text = trimmed(element->text, " \t\r\n");
    if (text.empty())
        return 0.0; // the standard's default
    double value = 0;
    if (parse_number(text.data(), text.data() + text.size(), value) != text.data() + text.size())
        return bad_input(printable(element->name) + " is " + printable_in_quotes(text) + ", which is not a number",
                         element->offset);
    return value;
}

Result<E57Xml> read_e57_xml(E57Pages &pages) {
    const FileRange at = pages.xml();
    if (at.bytes > kMaxE57XmlBytes)
        return too_large("the XML section has " + std::to_string(at.bytes) + " bytes, the limit is " +
                             std::to_string(kMaxE57XmlBytes),
                         24);
    Bytes bytes(static_cast<std::size_t>(at.bytes));
    if (Status read = pages.read(at.offset, bytes); !read)
        return read.error();
    return TreeBuilder(pages).parse(bytes);
}

} // namespace pbm::build
