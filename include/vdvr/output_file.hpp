// Files that appear only whole, for programs that write beside the library, and what is to be taken away when
// a program ends without unwinding.
#pragma once

#include <filesystem>
#include <string>

namespace vdvr::io {

/// Written under a temporary name in the same folder, flushed, renamed. Throws FileError when the folder does
/// not exist or cannot be written, ResourceError (disk).
void write_file(const std::filesystem::path& path, const std::string& bytes);

/// For a program that ends without unwinding: what remove_temporaries removes, files, and folders if they are
/// empty. The library notes each temporary file of its own.
void note_temporary(const std::filesystem::path& path);
void forget_temporary(const std::filesystem::path& path);
void remove_temporaries();

}  // namespace vdvr::io
