//! Reads regular files.

use std::fs;
use std::io;
use std::path::Path;

/// Reads all bytes of the file `path`.
///
/// # Errors
/// If it cannot be read, or is a pipe, a socket or a device, from which reading may never end.
pub fn bytes(path: &Path) -> io::Result<Vec<u8>> {
    let metadata = fs::metadata(path)?;
    // For a folder, the system returns an error.
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
