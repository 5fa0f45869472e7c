//! Reading `audit.json` again.

use std::io::Read;
use std::path::Path;

use unlift_io::Error;
use unlift_report::Document;

/// Reads the figures of an audit.
///
/// # Errors
/// When the file cannot be read, or is no `audit.json` of this version of the format.
pub fn read_document(path: &Path) -> anyhow::Result<Document> {
    let mut text = String::new();
    let (mut file, _) = unlift_io::input::open(path)?;
    file.read_to_string(&mut text).map_err(|error| Error::read(path, error))?;
    Document::from_json(&text).map_err(|error| {
        let said = error.to_string();
        // Which file it is, the user says.
        let said = said.strip_prefix("audit.json: ").unwrap_or(&said);
        anyhow::anyhow!("{}: {}", unlift::OneLine(path.display()), unlift::OneLine(said))
    })
}
