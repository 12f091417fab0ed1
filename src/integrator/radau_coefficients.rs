//! Coefficients of the three-stage Radau IIA method and of the transformation that splits its Newton system.
//!
//! E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 2nd ed., 1996, sections IV.5 and IV.8.

/// Stage positions `c1`, `c2`; `c3` is 1. `(4 ∓ √6)/10`.
pub(super) const C: [f64; 3] = [0.155_051_025_721_682_2, 0.644_948_974_278_317_8, 1.0];

/// Real eigenvalue of the inverse of the Runge-Kutta matrix, `3 + 9^(1/3) - 3^(1/3)`.
pub(super) const GAMMA: f64 = 3.637_834_252_744_496;

/// Real part of the complex pair of eigenvalues.
pub(super) const ALPHA: f64 = 2.681_082_873_627_752;

/// Imaginary part of the complex pair of eigenvalues.
pub(super) const BETA: f64 = 3.050_430_199_247_410_7;

/// Weights of the error estimate, `-(13 + 7√6)/3`, `(-13 + 7√6)/3`, `-1/3`.
pub(super) const E: [f64; 3] = [-10.048_809_399_827_414, 1.382_142_733_160_748_8, -1.0 / 3.0];

/// Weights of the stage increments in `h` times the rates at the end of the step: the last row of the inverse of the
/// Runge-Kutta matrix.
pub(super) const END_RATES: [f64; 3] = [5.531_972_647_421_809, -7.531_972_647_421_809, 5.0];

/// Transformation `Z = T W`.
pub(super) const T: [[f64; 3]; 3] = [
    [0.091_232_394_870_892_94, -0.141_255_295_020_954_2, -0.030_029_194_105_147_424],
    [0.241_717_932_707_107, 0.204_129_352_293_799_93, 0.382_942_112_757_261_9],
    [0.966_048_182_615_093, 1.0, 0.0],
];

/// Its inverse, `W = T⁻¹ Z`.
pub(super) const T_INVERSE: [[f64; 3]; 3] = [
    [4.325_579_890_063_155, 0.339_199_251_815_809_87, 0.541_770_539_935_874_9],
    [-4.178_718_591_551_905, -0.327_682_820_761_062_4, 0.476_623_554_500_550_43],
    [-0.502_872_634_945_787, 2.571_926_949_855_605, -0.596_039_204_828_224_9],
];

/// What `weights` of the stage increments are as weights of the transformed ones.
pub(super) const fn transformed(weights: [f64; 3]) -> [f64; 3] {
    let [a, b, c] = weights;
    [
        a * T[0][0] + b * T[1][0] + c * T[2][0],
        a * T[0][1] + b * T[1][1] + c * T[2][1],
        a * T[0][2] + b * T[1][2] + c * T[2][2],
    ]
}

/// `T⁻¹ [1, 1, 1]`: what the same value in all stages becomes.
pub(super) const T_INVERSE_SUM: [f64; 3] = [
    T_INVERSE[0][0] + T_INVERSE[0][1] + T_INVERSE[0][2],
    T_INVERSE[1][0] + T_INVERSE[1][1] + T_INVERSE[1][2],
    T_INVERSE[2][0] + T_INVERSE[2][1] + T_INVERSE[2][2],
];

/// `T⁻¹ C`: what a value that grows in proportion to time becomes.
pub(super) const T_INVERSE_C: [f64; 3] = [
    T_INVERSE[0][0] * C[0] + T_INVERSE[0][1] * C[1] + T_INVERSE[0][2],
    T_INVERSE[1][0] * C[0] + T_INVERSE[1][1] * C[1] + T_INVERSE[1][2],
    T_INVERSE[2][0] * C[0] + T_INVERSE[2][1] * C[1] + T_INVERSE[2][2],
];

#[cfg(test)]
mod tests {
    use super::*;

    /// Runge-Kutta matrix of Radau IIA, order 5.
    fn runge_kutta_matrix() -> [[f64; 3]; 3] {
        let s = 6.0_f64.sqrt();
        [
            [(88.0 - 7.0 * s) / 360.0, (296.0 - 169.0 * s) / 1800.0, (-2.0 + 3.0 * s) / 225.0],
            [(296.0 + 169.0 * s) / 1800.0, (88.0 + 7.0 * s) / 360.0, (-2.0 - 3.0 * s) / 225.0],
            [(16.0 - s) / 36.0, (16.0 + s) / 36.0, 1.0 / 9.0],
        ]
    }

    #[test]
    fn transformation_splits_the_method() {
        // A⁻¹ T = T Λ, so T = A T Λ with Λ the real block and the rotation block.
        let a = runge_kutta_matrix();
        let lambda = [[GAMMA, 0.0, 0.0], [0.0, ALPHA, -BETA], [0.0, BETA, ALPHA]];
        let multiply = |x: &[[f64; 3]; 3], y: &[[f64; 3]; 3]| -> [[f64; 3]; 3] {
            std::array::from_fn(|r| std::array::from_fn(|c| (0..3).map(|k| x[r][k] * y[k][c]).sum()))
        };
        let back = multiply(&multiply(&a, &T), &lambda);
        let unit = multiply(&T, &T_INVERSE);
        for r in 0..3 {
            for c in 0..3 {
                assert!((back[r][c] - T[r][c]).abs() < 1e-14, "{back:?}");
                assert!((unit[r][c] - f64::from(u8::from(r == c))).abs() < 1e-14, "{unit:?}");
            }
            assert!((a[r].iter().sum::<f64>() - C[r]).abs() < 1e-15);
            let last: f64 = (0..3).map(|k| END_RATES[k] * a[k][r]).sum();
            assert!((last - f64::from(u8::from(r == 2))).abs() < 1e-14, "{last}");
        }
    }
}
