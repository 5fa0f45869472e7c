use unlift::Error;

/// An array of floats, row-major.
#[derive(Clone, Debug, PartialEq)]
pub struct Tensor {
    shape: Vec<usize>,
    values: Vec<f32>,
}

impl Tensor {
    /// Creates an array with this shape.
    ///
    /// # Errors
    /// If the shape needs another number of values.
    pub fn try_new(shape: &[usize], values: Vec<f32>) -> Result<Self, Error> {
        let asked = shape.iter().try_fold(1_usize, |product, &side| product.checked_mul(side));
        if asked != Some(values.len()) {
            let expected = format!("values of the shape {shape:?}");
            return Err(Error::new("tensor", expected, format!("{} values", values.len())));
        }
        Ok(Self { shape: shape.to_vec(), values })
    }

    /// Returns the lengths of the sides, outermost first.
    pub fn shape(&self) -> &[usize] {
        &self.shape
    }

    /// Returns all values, row-major.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// Returns all values and consumes the tensor.
    pub fn into_values(self) -> Vec<f32> {
        self.values
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shape_has_its_number_of_values() {
        assert_eq!(Tensor::try_new(&[2, 3], vec![0.0; 6]).unwrap().shape(), [2, 3]);
        assert_eq!(Tensor::try_new(&[0, 9], vec![]).unwrap().values(), [0.0; 0]);
        let error = Tensor::try_new(&[2, usize::MAX], vec![0.0]).unwrap_err().to_string();
        assert_eq!(
            error,
            "tensor: expected values of the shape [2, 18446744073709551615], found 1 values"
        );
    }
}
