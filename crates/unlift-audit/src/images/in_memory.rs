use unlift_io::features::ImageFeatures;

use crate::Error;

type Get = Box<dyn Fn(usize) -> Result<ImageFeatures, Error> + Send + Sync>;

/// Images by name, each made on request. An audit requests a few at a time, and the drawn ones
/// again.
pub struct InMemory {
    names: Vec<String>,
    get: Get,
}

impl InMemory {
    /// Creates a source of the images `names`. `get` returns the features of the image with an
    /// index in `names`, from any thread.
    ///
    /// # Errors
    /// If `names` is empty, or not sorted by bytes without repetition: the order decides the last
    /// bits of sums.
    pub fn try_new(
        names: Vec<String>,
        get: impl Fn(usize) -> Result<ImageFeatures, Error> + Send + Sync + 'static,
    ) -> Result<Self, Error> {
        if names.is_empty() {
            return Err(Error::request("images: expected at least one, found none"));
        }
        if let Some(pair) = names.windows(2).find(|pair| pair[0].as_bytes() >= pair[1].as_bytes()) {
            let expected = "images: expected each name once, sorted by bytes";
            return Err(Error::request(format!(
                "{expected}, found {:?} before {:?}",
                pair[0], pair[1]
            )));
        }
        Ok(Self { names, get: Box::new(get) })
    }

    /// Returns the names of all images.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Returns the features of image `at`, under its name.
    ///
    /// # Errors
    /// If it cannot be made.
    pub fn get(&self, at: usize) -> Result<ImageFeatures, Error> {
        let name = self.names[at].clone();
        Ok(ImageFeatures { name, ..(self.get)(at)? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_stand_once_and_in_order() {
        let of = |names: &[&str]| {
            let names = names.iter().map(|name| (*name).to_owned()).collect();
            InMemory::try_new(names, |_| Ok(ImageFeatures::default()))
        };
        let images = of(&["B", "a"]).unwrap();
        assert_eq!(images.get(1).unwrap().name, "a");
        let line = |names: &[&str]| of(names).err().map(|error| error.to_string());
        let expected = "images: expected each name once, sorted by bytes, found \"a\" before \"a\"";
        assert_eq!(line(&["a", "a"]).as_deref(), Some(expected));
        assert!(line(&["a", "B"]).is_some());
        assert_eq!(line(&[]).as_deref(), Some("images: expected at least one, found none"));
    }
}
