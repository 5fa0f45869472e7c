//! The places of model files: in the user's folders, or embedded in the program.

use std::path::PathBuf;

use unlift::Error;

use super::registry::Entry;

/// The environment variable that names a folder of models.
pub const VARIABLE: &str = "UNLIFT_MODELS";

/// Folders that are searched for models before the embedded ones.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Folders {
    /// The folder in `UNLIFT_MODELS`.
    pub given: Option<PathBuf>,
    /// `unlift/models` in the user's data folder.
    pub user: Option<PathBuf>,
}

/// The place of a model.
#[derive(Clone, Debug, PartialEq)]
pub enum Place {
    /// A file.
    File(PathBuf),
    /// Embedded in the program.
    Carried,
}

impl Folders {
    /// Returns the folders of this process: `UNLIFT_MODELS`, and `XDG_DATA_HOME/unlift/models`
    /// (default `~/.local/share`, on Windows `%APPDATA%`).
    pub fn of_process() -> Self {
        let set =
            |name| std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
        let home = || match cfg!(windows) {
            true => set("APPDATA"),
            false => set("HOME").map(|home| home.join(".local").join("share")),
        };
        let user = set("XDG_DATA_HOME").or_else(home);
        Self { given: set(VARIABLE), user: user.map(|data| data.join("unlift").join("models")) }
    }

    /// Finds the file of `entry` in the folders, then in the program; `None` if it is missing.
    ///
    /// # Errors
    /// If `UNLIFT_MODELS` is not a folder.
    pub fn find(&self, entry: &Entry) -> Result<Option<Place>, Error> {
        if let Some(given) = &self.given
            && !given.is_dir()
        {
            let found = given.display().to_string();
            return Err(Error::new(VARIABLE, "a folder", found.escape_debug().to_string()));
        }
        let paths = [&self.given, &self.user].into_iter().flatten();
        let file = paths.map(|folder| folder.join(entry.file())).find(|path| path.is_file());
        Ok(file.map(Place::File).or(entry.carried.map(|_| Place::Carried)))
    }

    /// Returns the error for a missing `entry`, which names the folders it belongs in.
    pub fn missing(&self, entry: &Entry) -> Error {
        let folders = [&self.given, &self.user].into_iter().flatten();
        let folders: Vec<String> =
            folders.map(|folder| folder.display().to_string().escape_debug().to_string()).collect();
        let expected = match folders.as_slice() {
            [] => format!("in the folder that {VARIABLE} names"),
            folders => format!("in {}", folders.join(" or ")),
        };
        let expected = format!("{expected} ({})", entry.owner);
        Error::new(entry.file(), expected, "nothing")
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::network::registry::MODELS;

    #[test]
    fn folders_come_before_the_program_and_the_given_one_first() {
        let place = tempfile::tempdir().unwrap();
        let [given, user] = ["given", "user"].map(|name| place.path().join(name));
        fs::create_dir(&given).unwrap();
        let folders = Folders { given: Some(given.clone()), user: Some(user.clone()) };
        let entry = &MODELS[0];
        assert_eq!(folders.find(entry), Ok(Some(Place::Carried)));
        fs::create_dir(&user).unwrap();
        for folder in [user, given] {
            let file = folder.join(entry.file());
            fs::write(&file, "a model").unwrap();
            assert_eq!(folders.find(entry), Ok(Some(Place::File(file))));
        }
    }

    #[test]
    fn what_is_missing_is_told_with_where_it_belongs() {
        let entry = Entry { carried: None, ..own() };
        let folders = Folders { given: None, user: Some("data/unlift/models".into()) };
        assert_eq!(folders.find(&entry), Ok(None));
        assert_eq!(
            folders.missing(&entry).to_string(),
            "mine.onnx: expected in data/unlift/models (its owner's page), found nothing"
        );
        let folders = Folders { given: Some("no such folder".into()), user: None };
        assert_eq!(
            folders.find(&entry).unwrap_err().to_string(),
            "UNLIFT_MODELS: expected a folder, found no such folder"
        );
    }

    fn own() -> Entry {
        Entry {
            name: "mine",
            purpose: "a test",
            licence: "MIT",
            owner: "its owner's page",
            sha256: None,
            inputs: &[],
            outputs: &[],
            carried: None,
        }
    }
}
