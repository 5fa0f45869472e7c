//! Replaces `unlift-nn` in builds without the feature `networks`: no network loads.

use std::convert::Infallible;

use unlift::Error;

/// A network that cannot be loaded.
pub struct Network(Infallible);

/// An input or output of such a network.
pub struct Tensor(Infallible);

fn missing<T>(what: &str) -> Result<T, Error> {
    let expected = "unlift-features with the feature `networks`";
    Err(Error::new(what, expected, "a build without it"))
}

impl Network {
    /// Names the feature that loads `name`.
    pub fn load(name: &str) -> Result<Self, Error> {
        missing(name)
    }

    pub fn sha256(&self) -> &str {
        match self.0 {}
    }

    pub fn run<const N: usize>(
        &self,
        _: Vec<(&str, Tensor)>,
        _: [&str; N],
    ) -> Result<[Tensor; N], Error> {
        match self.0 {}
    }
}

impl Tensor {
    pub fn try_new(_: &[usize], _: Vec<f32>) -> Result<Self, Error> {
        missing("tensor")
    }

    pub fn shape(&self) -> &[usize] {
        match self.0 {}
    }

    pub fn values(&self) -> &[f32] {
        match self.0 {}
    }

    pub fn into_values(self) -> Vec<f32> {
        match self.0 {}
    }
}
