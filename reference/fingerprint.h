// A number that tells one set of inputs from another.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>
#include <vector>

namespace lobe {

// Eight bytes at a time through the multiplication of FNV-1a (Fowler, Noll, Vo), with a shift that feeds back high
// bits.
class Fingerprint {
public:
    Fingerprint& bytes(const void* data, std::size_t size) {
        const auto* p = static_cast<const unsigned char*>(data);
        for (std::size_t i = 0; i < size; i += 8) {
            std::uint64_t word = 0;
            std::memcpy(&word, p + i, std::min<std::size_t>(8, size - i));
            mix(word);
        }
        mix(size);
        return *this;
    }
    template <class T> Fingerprint& add(const T& value) {
        static_assert(std::has_unique_object_representations_v<T> || std::is_floating_point_v<T>);
        return bytes(&value, sizeof value);
    }
    template <class T> Fingerprint& add(const std::vector<T>& list) {
        return bytes(list.data(), list.size() * sizeof(T));
    }
    Fingerprint& add(const std::string& text) { return bytes(text.data(), text.size()); }
    template <class T> requires requires(const T& v) { v.x, v.y, v.z; } Fingerprint& add(const T& v) {
        return add(v.x).add(v.y).add(v.z);
    }
    std::uint64_t value() const { return value_; }

private:
    void mix(std::uint64_t word) {
        value_ = (value_ ^ word) * 0x100000001b3u;
        value_ ^= value_ >> 32;
    }
    std::uint64_t value_ = 0xcbf29ce484222325u;
};

}  // namespace lobe
