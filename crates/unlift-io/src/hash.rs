//! Hashes of input files, so that a result identifies its inputs.

use crate::Error;
use crate::features::ImageFeatures;
use crate::input;
use sha2::{Digest, Sha256};
use std::io::Read;
use std::path::Path;
use unlift::Descriptors;
use unlift::descriptors::Values;

/// Returns the SHA-256 of a file's content, as 64 hexadecimal digits.
pub fn hash_file(path: &Path) -> Result<String, Error> {
    let (mut file, _) = input::open(path)?;
    let (mut hasher, mut piece) = (Sha256::new(), Vec::new());
    loop {
        piece.clear();
        let read = file.by_ref().take(1 << 16).read_to_end(&mut piece);
        if read.map_err(|source| Error::read(path, source))? == 0 {
            return Ok(hex(hasher));
        }
        hasher.update(&piece);
    }
}

/// Returns one SHA-256, as 64 hexadecimal digits, over the names and contents of `paths`.
///
/// It is the SHA-256 of the lines `HASH  NAME\n`, sorted by bytes of the name without folders, then
/// by hash. In the folder of the files, in the C locale, this is
///
/// ```sh
/// sha256sum cameras.bin images.bin points3D.bin | sha256sum
/// ```
pub fn hash_files<P: AsRef<Path>>(paths: &[P]) -> Result<String, Error> {
    let named = paths.iter().map(|path| {
        let name = path.as_ref().file_name().unwrap_or_default();
        Ok((name.to_string_lossy().into_owned(), hash_file(path.as_ref())?))
    });
    Ok(hash_list(named.collect::<Result<_, Error>>()?))
}

/// Combines names and hashes like [`hash_files`], also for data that is not in files.
pub fn hash_list(mut named: Vec<(String, String)>) -> String {
    named.sort();
    hash(named.iter().map(|(name, hash)| format!("{hash}  {name}\n")))
}

/// Returns the SHA-256 of the features that an audit uses: width and height as little-endian `u32`
/// (0 if unknown), the coordinates of keypoints as `f64`, and the values of descriptors row by row, as bytes or `f32`.
pub fn hash_features(features: &ImageFeatures) -> String {
    let mut hasher = Sha256::new();
    for side in features.size.unwrap_or([0; 2]) {
        hasher.update(side.to_le_bytes());
    }
    features.keypoints.as_flattened().iter().for_each(|x| hasher.update(x.to_le_bytes()));
    match features.descriptors.as_ref().map(Descriptors::values) {
        Some(Values::U8(bytes)) => hasher.update(bytes),
        Some(Values::F32(values)) => {
            values.iter().for_each(|value| hasher.update(value.to_le_bytes()))
        }
        None => {}
    }
    hex(hasher)
}

/// Returns the SHA-256 of positions as little-endian `f64`.
pub fn hash_positions(positions: &[[f64; 3]]) -> String {
    hash(positions.as_flattened().iter().map(|x| x.to_le_bytes()))
}

fn hash(pieces: impl Iterator<Item = impl AsRef<[u8]>>) -> String {
    hex(pieces.fold(Sha256::new(), Sha256::chain_update))
}

fn hex(hasher: Sha256) -> String {
    hasher.finalize().iter().map(|b| format!("{b:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn files_hash_as_sha256sum_does_in_any_order_and_by_their_names() {
        let folder = tempfile::tempdir().unwrap();
        let [a, b, c] = ["a", "b", "c"].map(|name| folder.path().join(name));
        fs::write(&a, "abc").unwrap();
        fs::write(&b, "").unwrap();
        fs::write(&c, "abc").unwrap();
        // FIPS 180-2, appendix B.1.
        let published = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(hash_file(&a).unwrap(), published);
        // printf abc > a; printf '' > b; sha256sum a b | sha256sum
        let expected = "09c7e0b8a02d027d95ec0375a600ed4ad4d6b26a1c93f16d9150cab5fec761a6";
        assert_eq!(hash_files(&[&a, &b]).unwrap(), expected);
        assert_eq!(hash_files(&[&b, &a]).unwrap(), expected);
        assert_ne!(hash_files(&[&a]).unwrap(), hash_files(&[&c]).unwrap());
    }

    #[test]
    fn features_hash_by_all_that_an_audit_looks_at() {
        let features = ImageFeatures {
            size: Some([640, 480]),
            keypoints: vec![[1.0, 2.0], [3.0, 4.0]],
            descriptors: Descriptors::try_new(Values::U8(vec![1, 2, 3, 4]), 2).ok(),
            ..ImageFeatures::default()
        };
        // struct.pack("<2I4d4B", 640, 480, 1, 2, 3, 4, 1, 2, 3, 4)
        let expected = "0cbcd3b3d08473d8346a9e417d3f454810addd97a50bda7eefc101eaf4f9f67d";
        assert_eq!(hash_features(&features), expected);
        let named = ImageFeatures { name: "a.jpg".to_owned(), ..features.clone() };
        assert_eq!(hash_features(&named), expected);
        let other = ImageFeatures { size: Some([480, 640]), ..features };
        assert_ne!(hash_features(&other), expected);
    }
}
