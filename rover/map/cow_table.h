#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "rover/base/ids.h"

namespace rover {

// A table of values by id with copy on write: copying the table copies a pointer per 64 ids, and
// what is edited afterwards is cloned first. This is what makes published views of a map immutable
// and cheap. Iteration is in id order.
//
// A value may be edited in place only while it is younger than the last copy: each table carries
// a version, freeze() ends it, and pages and values remember the version that made them. So no
// reference count is ever consulted, and readers of copies never race with the writer.
template <class IdType, class T>
class CowTable {
 public:
  const T* find(IdType id) const {
    const Entry* entry = entry_of(id);
    return entry ? &entry->value : nullptr;
  }

  const T& at(IdType id) const { return entry_of(id)->value; }
  bool contains(IdType id) const { return entry_of(id) != nullptr; }
  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }

  // The value for writing; it must exist.
  T& edit(IdType id) {
    std::shared_ptr<Entry>& entry = slot_for_writing(id);
    if (entry->version != version_) entry = std::make_shared<Entry>(Entry{version_, entry->value});
    return entry->value;
  }

  void insert(IdType id, T value) {
    std::shared_ptr<Entry>& entry = slot_for_writing(id);
    if (!entry) ++size_;
    entry = std::make_shared<Entry>(Entry{version_, std::move(value)});
  }

  void erase(IdType id) {
    if (!contains(id)) return;
    slot_for_writing(id).reset();
    --size_;
  }

  // Everything made so far becomes immutable: called when a copy is about to be shared.
  void freeze() { ++version_; }

  class Iterator {
   public:
    Iterator(const CowTable* table, std::size_t index) : table_(table), index_(index) { skip(); }
    const T& operator*() const { return table_->value(index_); }
    const T* operator->() const { return &table_->value(index_); }
    Iterator& operator++() {
      ++index_;
      skip();
      return *this;
    }
    bool operator==(const Iterator& other) const { return index_ == other.index_; }

   private:
    void skip() {
      while (index_ < table_->capacity() && !table_->occupied(index_)) ++index_;
    }
    const CowTable* table_;
    std::size_t index_;
  };

  Iterator begin() const { return {this, 0}; }
  Iterator end() const { return {this, capacity()}; }

 private:
  static constexpr std::size_t kPageSize = 64;
  struct Entry {
    std::uint64_t version;
    T value;
  };
  struct Page {
    std::uint64_t version;
    std::array<std::shared_ptr<Entry>, kPageSize> entries;
  };

  std::size_t capacity() const { return pages_.size() * kPageSize; }
  bool occupied(std::size_t index) const {
    const auto& page = pages_[index / kPageSize];
    return page && page->entries[index % kPageSize];
  }
  const T& value(std::size_t index) const {
    return pages_[index / kPageSize]->entries[index % kPageSize]->value;
  }
  const Entry* entry_of(IdType id) const {
    const auto index = static_cast<std::size_t>(id.value);
    if (!id.valid() || index >= capacity() || !pages_[index / kPageSize]) return nullptr;
    return pages_[index / kPageSize]->entries[index % kPageSize].get();
  }
  std::shared_ptr<Entry>& slot_for_writing(IdType id) {
    const auto index = static_cast<std::size_t>(id.value);
    if (index >= capacity()) pages_.resize(index / kPageSize + 1);
    std::shared_ptr<Page>& page = pages_[index / kPageSize];
    if (!page) {
      page = std::make_shared<Page>(Page{version_, {}});
    } else if (page->version != version_) {
      page = std::make_shared<Page>(Page{version_, page->entries});
    }
    return page->entries[index % kPageSize];
  }

  std::vector<std::shared_ptr<Page>> pages_;
  std::size_t size_ = 0;
  std::uint64_t version_ = 0;
};

}  // namespace rover
