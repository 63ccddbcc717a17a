// SPDX-License-Identifier: MIT
#include "sdf/mesh/mesh_file.h"

#include <algorithm>
#include <bit>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>
#include <stdexcept>
#include <string_view>

#include "base/short_text.h"

namespace sdftrack::sdf {

namespace {

static_assert(std::endian::native == std::endian::little, "binary files are read as they are");

constexpr std::size_t kStlHead = 84, kStlFace = 50;  // bytes
constexpr double kMostCorners = 1000;                // of a face; more is a damaged file

[[noreturn]] void refuse_file(const std::string& text) { throw std::invalid_argument(text); }

// Words and numbers of a text, one after the other.
class Words {
 public:
  explicit Words(std::string_view text) : text_(text) {}

  std::string_view next() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_]))) ++at_;
    const std::size_t begin = at_;
    while (at_ < text_.size() && !std::isspace(static_cast<unsigned char>(text_[at_]))) ++at_;
    return text_.substr(begin, at_ - begin);
  }
  double number() {
    const std::string_view word = next();
    if (word.empty()) refuse_file("truncated: a number is missing at its end");
    double out = 0;
    const auto [end, error] = std::from_chars(word.data() + (word[0] == '+'), word.data() + word.size(), out);
    if (error != std::errc() || end != word.data() + word.size())
      refuse_file("expected a number, got '" + std::string(word.substr(0, 40)) + "'");
    return out;
  }

 private:
  std::string_view text_;
  std::size_t at_ = 0;
};

std::string_view next_line(std::string_view text, std::size_t* at) {
  const std::size_t end = std::min(text.find('\n', *at), text.size());
  std::string_view line = text.substr(*at, end - *at);
  *at = end + 1;
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  return line;
}

void add_fan(const std::vector<double>& corners, CleanMesh* mesh) {
  for (const double c : corners)
    if (!(c >= 0 && c < double(mesh->vertices.size()) && c == std::floor(c)))
      refuse_file("a face has the vertex " + short_text(c) + ", the file holds " +
                  std::to_string(mesh->vertices.size()));
  const auto at = [&](std::size_t i) { return static_cast<std::int32_t>(corners[i]); };
  for (std::size_t i = 2; i < corners.size(); ++i) mesh->faces.push_back({at(0), at(i - 1), at(i)});
}

// -- PLY: a header that lists elements with their properties, then the values as text or binary

struct Property {
  std::string name, type, count_type;  // count_type: of a list, else empty
};
struct Element {
  std::string name;
  double count = 0;
  std::vector<Property> properties;
};

class PlyValues {
 public:
  PlyValues(std::string_view body, bool binary) : body_(body), binary_(binary), words_(body) {}

  double next(const std::string& type) {
    if (!binary_) return words_.number();
    if (type == "float" || type == "float32") return taken<float>();
    if (type == "double" || type == "float64") return taken<double>();
    if (type == "uchar" || type == "uint8") return taken<std::uint8_t>();
    if (type == "char" || type == "int8") return taken<std::int8_t>();
    if (type == "ushort" || type == "uint16") return taken<std::uint16_t>();
    if (type == "short" || type == "int16") return taken<std::int16_t>();
    if (type == "uint" || type == "uint32") return taken<std::uint32_t>();
    if (type == "int" || type == "int32") return taken<std::int32_t>();
    refuse_file("unknown type '" + type + "'");
  }

 private:
  template <class T>
  double taken() {
    if (body_.size() - at_ < sizeof(T)) refuse_file("truncated: values of its header are missing");
    T value;
    std::memcpy(&value, body_.data() + at_, sizeof value);
    at_ += sizeof value;
    return double(value);
  }

  std::string_view body_;
  bool binary_;
  std::size_t at_ = 0;
  Words words_;
};

std::vector<Element> ply_header(std::string_view text, std::size_t* at, bool* binary) {
  std::vector<Element> out;
  while (*at < text.size()) {
    Words words(next_line(text, at));
    const std::string_view key = words.next();
    if (key == "end_header") return out;
    if (key == "format") {
      const std::string_view format = words.next();
      if (format != "ascii" && format != "binary_little_endian")
        refuse_file("expected ascii or binary_little_endian, got " + std::string(format));
      *binary = format != "ascii";
    } else if (key == "element") {
      const std::string name(words.next());
      out.push_back({name, words.number(), {}});
    } else if (key == "property" && !out.empty()) {
      Property property;
      property.type = words.next();
      if (property.type == "list") property.count_type = words.next(), property.type = words.next();
      property.name = words.next();
      out.back().properties.push_back(property);
    }
  }
  refuse_file("truncated: its header has no end");
}

void read_item(const Element& element, PlyValues* values, CleanMesh* mesh) {
  Vec3d p{0, 0, 0};
  std::vector<double> corners;
  for (const Property& property : element.properties) {
    const double first = values->next(property.count_type.empty() ? property.type : property.count_type);
    if (property.count_type.empty()) {
      if (property.name == "x") p.x = first;
      if (property.name == "y") p.y = first;
      if (property.name == "z") p.z = first;
      continue;
    }
    if (!(first >= 0 && first <= kMostCorners)) refuse_file("a list has an unlikely length");
    const bool is_face = property.name == "vertex_indices" || property.name == "vertex_index";
    for (int i = 0; i < first; ++i) {
      const double value = values->next(property.type);
      if (is_face) corners.push_back(value);
    }
  }
  if (element.name == "vertex") mesh->vertices.push_back(p);
  if (element.name == "face") add_fan(corners, mesh);
}

void read_ply(std::string_view text, CleanMesh* mesh) {
  std::size_t at = 0;
  if (next_line(text, &at) != "ply") refuse_file("expected 'ply' in its first line");
  bool binary = false;
  const std::vector<Element> elements = ply_header(text, &at, &binary);
  PlyValues values(text.substr(std::min(at, text.size())), binary);
  for (const Element& element : elements)
    for (double i = 0; !element.properties.empty() && i < element.count; ++i)
      read_item(element, &values, mesh);
}

// -- OBJ and STL

void read_obj(std::string_view text, CleanMesh* mesh) {
  std::vector<std::vector<double>> faces;  // their vertices may follow
  for (std::size_t at = 0; at < text.size();) {
    Words words(next_line(text, &at));
    const std::string_view key = words.next();
    if (key == "v") {
      const double x = words.number(), y = words.number(), z = words.number();
      mesh->vertices.push_back({x, y, z});
    } else if (key == "f") {
      faces.emplace_back();
      for (std::string_view word; !(word = words.next()).empty();) {
        const double number = Words(word.substr(0, word.find('/'))).number();
        faces.back().push_back(number > 0 ? number - 1 : number + double(mesh->vertices.size()));
      }
    }
  }
  for (const std::vector<double>& corners : faces) add_fan(corners, mesh);
}

void read_stl(std::string_view text, CleanMesh* mesh) {
  std::uint32_t count = 0;
  if (text.size() >= kStlHead) std::memcpy(&count, text.data() + kStlHead - sizeof count, sizeof count);
  const auto add = [&](Vec3d p) {
    mesh->vertices.push_back(p);
    if (mesh->vertices.size() % 3) return;
    const auto n = static_cast<std::int32_t>(mesh->vertices.size());
    mesh->faces.push_back({n - 3, n - 2, n - 1});
  };
  if (text.size() >= kStlHead && text.size() == kStlHead + kStlFace * std::size_t{count}) {
    for (std::size_t i = 0; i < count; ++i) {
      float p[12];  // the normal, and three corners
      std::memcpy(p, text.data() + kStlHead + kStlFace * i, sizeof p);
      for (const int k : {3, 6, 9}) add(Vec3f{p[k], p[k + 1], p[k + 2]}.cast<double>());
    }
    return;
  }
  if (!text.starts_with("solid")) refuse_file("truncated: it holds fewer triangles than it states");
  Words words(text);
  for (std::string_view word; !(word = words.next()).empty();) {
    if (word != "vertex") continue;
    const double x = words.number(), y = words.number(), z = words.number();
    add({x, y, z});
  }
  if (mesh->vertices.size() % 3) refuse_file("truncated: a triangle has fewer than three corners");
}

}  // namespace

std::string bytes_of(const std::string& file) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> stream(std::fopen(file.c_str(), "rb"), &std::fclose);
  if (!stream) refuse_file("no such file, or it may not be read");
  std::string out;
  char part[1 << 16];
  for (std::size_t n; (n = std::fread(part, 1, sizeof part, stream.get())) > 0;) out.append(part, n);
  return out;
}

CleanMesh read_mesh_file(const std::string& file) {
  CleanMesh mesh;
  std::string end = file.substr(std::min(file.rfind('.'), file.size()));
  for (char& c : end) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  try {
    const std::string text = bytes_of(file);
    if (end == ".ply")
      read_ply(text, &mesh);
    else if (end == ".obj")
      read_obj(text, &mesh);
    else if (end == ".stl")
      read_stl(text, &mesh);
    else
      refuse_file("expected .ply, .obj or .stl");
  } catch (const std::invalid_argument& error) {
    refuse_file("mesh: cannot read " + file + ": " + error.what());
  }
  return mesh;
}

}  // namespace sdftrack::sdf
