//! The bytes of a file that is one.

use std::fs;
use std::io;
use std::path::Path;

/// All bytes of the file `path`.
///
/// # Errors
/// When it cannot be read, or is a pipe, a socket or a device: these may never end, or never begin.
pub fn bytes(path: &Path) -> io::Result<Vec<u8>> {
    let metadata = fs::metadata(path)?;
    // Of a folder, the system says so.
    if !metadata.is_file() && !metadata.is_dir() {
        return Err(io::Error::other("a pipe, a socket or a device"));
    }
    fs::read(path)
}

#[cfg(test)]
mod tests {
    #[cfg(unix)]
    #[test]
    fn only_regular_files_are_read() {
        let error = super::bytes(std::path::Path::new("/dev/zero")).unwrap_err();
        assert_eq!(error.to_string(), "a pipe, a socket or a device");
    }
}
