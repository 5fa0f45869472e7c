//! The manifest of a folder of parts.

use super::header::to_text;
use crate::{Error, input};
use serde_json::{Map, Value, json};
use std::collections::BTreeSet;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

/// The manifest of a folder of parts, which detects missing and changed parts. Engines skip names
/// that begin with `_`.
pub(super) const MANIFEST: &str = "_manifest.json";

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Part {
    pub(super) file: String,
    pub(super) n_rows: u64,
    pub(super) n_bytes: u64,
}

/// The parts of a folder, in order, and their common metadata.
#[derive(Debug)]
pub(super) struct Manifest {
    meta: Map<String, Value>,
    parts: Vec<Part>,
}

impl Manifest {
    pub(super) fn new(meta: Map<String, Value>, parts: Vec<Part>) -> Self {
        Self { meta, parts }
    }

    /// Reads the manifest of a folder, if there is one.
    pub(super) fn read(folder: &Path) -> Result<Option<Self>, Error> {
        let path = folder.join(MANIFEST);
        if !path.exists() {
            return Ok(None);
        }
        let (file, n_bytes) = input::open(&path)?;
        input::Budget::new(&path, n_bytes).admit("", n_bytes)?;
        let mut text = String::new();
        file.take(n_bytes)
            .read_to_string(&mut text)
            .map_err(|source| Error::read(&path, source))?;
        let wrong = |place: &str, expected: &str, found: String| {
            Err(Error::new(&path, place, expected, found))
        };
        let value: Value = match serde_json::from_str(&text) {
            Ok(value) => value,
            Err(error) => return wrong("", "a JSON object", error.to_string()),
        };
        let Some(Value::Object(meta)) = value.get("unlift").cloned() else {
            return wrong("unlift", "the metadata of the parts", "no object".into());
        };
        let mut parts = Vec::new();
        for row in value["parts"].as_array().map_or(&[][..], Vec::as_slice) {
            let part = (row["file"].as_str(), row["rows"].as_u64(), row["bytes"].as_u64());
            let (Some(file), Some(n_rows), Some(n_bytes)) = part else {
                let place = format!("parts, {}", parts.len());
                return wrong(&place, "file, rows and bytes", "others".into());
            };
            parts.push(Part { file: file.to_owned(), n_rows, n_bytes });
        }
        Ok(Some(Self { meta, parts }))
    }

    pub(super) fn meta_text(&self) -> String {
        to_text(self.meta.clone())
    }

    /// Returns an error if the folder contains other parts than the manifest.
    pub(super) fn check_names(&self, folder: &Path, names: &[PathBuf]) -> Result<(), Error> {
        let wrong = |expected: String, found: String| Err(Error::new(folder, "", expected, found));
        let (known, found): (BTreeSet<&Path>, BTreeSet<&Path>) = (
            self.parts.iter().map(|part| Path::new(&part.file)).collect(),
            names.iter().map(PathBuf::as_path).collect(),
        );
        if let Some(lost) = known.difference(&found).next() {
            let expected = format!("{}, as in {MANIFEST}", lost.display());
            return wrong(expected, "no such file".into());
        }
        match found.difference(&known).next() {
            Some(other) => {
                wrong(format!("only the parts of {MANIFEST}"), format!("also {}", other.display()))
            }
            None => Ok(()),
        }
    }

    pub(super) fn check_part(
        &self,
        at: usize,
        path: &Path,
        found: (u64, u64),
    ) -> Result<(), Error> {
        let name = path.file_name().unwrap_or_default();
        let Some(part) = self.parts.get(at).filter(|part| Path::new(&part.file) == name) else {
            return Err(Error::new(path, "", "parts in the order of their names", "another order"));
        };
        if (part.n_rows, part.n_bytes) == found {
            return Ok(());
        }
        let told = |(rows, bytes)| format!("{rows} rows in {bytes} bytes");
        let expected = format!("{}, as in {MANIFEST}", told((part.n_rows, part.n_bytes)));
        Err(Error::new(path, "", expected, told(found)))
    }

    /// Writes the manifest. Equal values make equal bytes.
    pub(super) fn write(&self, to: &mut impl Write) -> std::io::Result<()> {
        let n_rows: u64 = self.parts.iter().map(|part| part.n_rows).sum();
        write!(to, "{{\n\"unlift\": {},\n\"rows\": {n_rows},\n\"parts\": [", self.meta_text())?;
        for (at, part) in self.parts.iter().enumerate() {
            let Part { file, n_rows, n_bytes } = part;
            let end = if at == 0 { "" } else { "," };
            write!(
                to,
                "{end}\n{{\"file\": {}, \"rows\": {n_rows}, \"bytes\": {n_bytes}}}",
                json!(file)
            )?;
        }
        to.write_all(b"\n]\n}\n")
    }
}
