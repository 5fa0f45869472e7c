use std::fmt;

/// An error of an audit.
#[derive(Debug)]
pub struct Error {
    fault: Fault,
    advice: Option<String>,
}

#[derive(Debug)]
enum Fault {
    /// The request cannot be carried out.
    Request(String),
    /// A file cannot be read, used or written.
    Input(Box<dyn std::error::Error + Send + Sync>),
}

impl Error {
    /// Creates an error of the request, not of a file.
    pub fn request(message: impl Into<String>) -> Self {
        Self { fault: Fault::Request(message.into()), advice: None }
    }

    fn input(error: impl std::error::Error + Send + Sync + 'static) -> Self {
        Self { fault: Fault::Input(Box::new(error)), advice: None }
    }

    /// Adds advice: what the user could try instead.
    #[must_use]
    pub fn advise(self, advice: impl Into<String>) -> Self {
        Self { advice: Some(advice.into()), ..self }
    }

    /// Returns true if the request is wrong, not a file.
    pub fn is_request(&self) -> bool {
        matches!(self.fault, Fault::Request(_))
    }

    /// Returns what the user could try instead.
    pub fn advice(&self) -> Option<&str> {
        self.advice.as_deref()
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.fault {
            Fault::Request(message) => f.write_str(message),
            Fault::Input(error) => {
                write!(f, "{error}")?;
                let mut source = error.source();
                while let Some(error) = source {
                    write!(f, ": {error}")?;
                    source = error.source();
                }
                Ok(())
            }
        }
    }
}

impl std::error::Error for Error {}

impl From<unlift::Error> for Error {
    fn from(error: unlift::Error) -> Self {
        Self::input(error)
    }
}

impl From<unlift_io::Error> for Error {
    fn from(error: unlift_io::Error) -> Self {
        Self::input(error)
    }
}

impl From<unlift_report::Error> for Error {
    fn from(error: unlift_report::Error) -> Self {
        Self::input(error)
    }
}

impl From<serde_json::Error> for Error {
    fn from(error: serde_json::Error) -> Self {
        Self::input(error)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn advice_stands_beside_the_line() {
        let error = Error::request("--k: expected at most 10, found 50").advise("--k 10");
        assert!(error.is_request());
        assert_eq!(error.to_string(), "--k: expected at most 10, found 50");
        assert_eq!(error.advice(), Some("--k 10"));
        let error = Error::from(unlift::Error::new("points", "51", "3"));
        assert!(!error.is_request());
        assert_eq!(error.to_string(), "points: expected 51, found 3");
    }
}
