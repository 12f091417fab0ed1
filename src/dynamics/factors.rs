//! The factors of `σ I - ∂f/∂y`, the matrix of Newton's method, and the solution with them.
//!
//! Velocities are eliminated first (`Δq = (r_q + Δv)/σ`), then each cable's own block; what remains is one 3×3 system
//! in `Δv`.

use super::linearisation::{BLOCK, CableBlock, Linearisation};
use super::matrix3::{self, Field, Matrix3};

/// One cable's part. With `D = σ I - ∂f_c/∂c` over its own states `c`:
#[derive(Clone, Debug)]
struct CableFactors<F> {
    /// `D⁻¹`.
    inverse: [[F; BLOCK]; BLOCK],
    /// Row `∂T/∂c D⁻¹`.
    tension: [F; BLOCK],
}

/// `(σ I - ∂f/∂y)⁻¹` for one `σ`, real or complex.
#[derive(Clone, Debug)]
pub(crate) struct Factors<F> {
    inverse_sigma: F,
    schur_inverse: Matrix3<F>,
    /// `∂(forces)/∂q` with the cables' answer, over `σ`, negative.
    pose_coupling: Matrix3<F>,
    cables: Vec<CableFactors<F>>,
}

impl<F: Field> Factors<F> {
    /// Room for the factors of `cables` cables.
    pub(crate) fn empty(cables: usize) -> Self {
        let zero = F::zero();
        let cable = CableFactors { inverse: [[zero; BLOCK]; BLOCK], tension: [zero; BLOCK] };
        Self {
            inverse_sigma: zero,
            schur_inverse: [[zero; 3]; 3],
            pose_coupling: [[zero; 3]; 3],
            cables: vec![cable; cables],
        }
    }

    /// Factors the linearisation at `sigma`.
    pub(crate) fn update(&mut self, linearisation: &Linearisation, sigma: F) {
        let lift = |m: f64| F::from(m);
        self.inverse_sigma = F::one() / sigma;
        let mut schur: Matrix3<F> = std::array::from_fn(|r| {
            std::array::from_fn(|c| sigma.scale(linearisation.mass[r][c]) - lift(linearisation.force_by_twist[r][c]))
        });
        self.pose_coupling = linearisation.force_by_pose.map(|row| row.map(|v| lift(-v)));
        for (block, factors) in linearisation.cables.iter().zip(&mut self.cables) {
            invert(block, sigma, &mut factors.inverse);
            let n = block.size;
            let mut by = [F::zero(); 3]; // tension answer to length, rate, angular rate
            for c in 0..n {
                let mut sum = F::zero();
                for r in 0..n {
                    sum += factors.inverse[r][c].scale(block.tension_by_state[r]);
                }
                factors.tension[c] = sum;
                for (answer, rate) in by.iter_mut().zip(&block.rates_by_motion[c]) {
                    *answer += sum.scale(*rate);
                }
            }
            let row = block.jacobian.map(lift);
            let curvature = block.curvature.map(lift);
            let normal = block.normal_over_length.map(lift);
            matrix3::add_outer(&mut self.pose_coupling, &row, &row, by[0]);
            matrix3::add_outer(&mut self.pose_coupling, &row, &curvature, by[1]);
            matrix3::add_outer(&mut schur, &row, &row, by[1]);
            matrix3::add_outer(&mut schur, &row, &normal, by[2]);
        }
        for r in 0..3 {
            for c in 0..3 {
                self.pose_coupling[r][c] *= self.inverse_sigma;
                schur[r][c] += self.pose_coupling[r][c];
            }
        }
        self.schur_inverse = matrix3::inverse(&schur);
    }

    /// Solves `(σ I - ∂f/∂y) x = b` in place; `offset` is where each cable's states begin.
    #[inline]
    pub(crate) fn solve(&self, linearisation: &Linearisation, offset: &[usize], b: &mut [F]) {
        let rq = [b[0], b[1], b[2]];
        let rv = [b[3], b[4], b[5]];
        let coupled = matrix3::product(&self.pose_coupling, &rq);
        let mut rhs: [F; 3] = std::array::from_fn(|r| {
            let m = &linearisation.mass[r];
            rv[0].scale(m[0]) + rv[1].scale(m[1]) + rv[2].scale(m[2]) - coupled[r]
        });
        for (i, block) in linearisation.cables.iter().enumerate() {
            let own = &b[offset[i]..offset[i] + block.size];
            let mut tension = F::zero();
            for (t, r) in self.cables[i].tension.iter().zip(own) {
                tension += *t * *r;
            }
            for c in 0..3 {
                rhs[c] -= tension.scale(block.jacobian[c]);
            }
        }
        let dv = matrix3::product(&self.schur_inverse, &rhs);
        let dq: [F; 3] = std::array::from_fn(|k| (rq[k] + dv[k]) * self.inverse_sigma);
        let along = |row: &[f64; 3], v: &[F; 3]| v[0].scale(row[0]) + v[1].scale(row[1]) + v[2].scale(row[2]);
        for (i, block) in linearisation.cables.iter().enumerate() {
            let motion = [
                along(&block.jacobian, &dq),
                along(&block.jacobian, &dv) + along(&block.curvature, &dq),
                along(&block.normal_over_length, &dv),
            ];
            let own = &mut b[offset[i]..offset[i] + block.size];
            match own.len() {
                0 => {}
                1 => self.cables[i].answer::<1>(block, &motion, own),
                2 => self.cables[i].answer::<2>(block, &motion, own),
                3 => self.cables[i].answer::<3>(block, &motion, own),
                4 => self.cables[i].answer::<4>(block, &motion, own),
                _ => {
                    let mut padded = [F::zero(); BLOCK];
                    padded[..own.len()].copy_from_slice(own);
                    self.cables[i].answer::<BLOCK>(block, &motion, &mut padded);
                    own.copy_from_slice(&padded[..own.len()]);
                }
            }
        }
        b[..3].copy_from_slice(&dq);
        b[3..6].copy_from_slice(&dv);
    }
}

impl<F: Field> CableFactors<F> {
    /// The cable's own states from their right-hand sides and the motion of its end.
    #[inline]
    fn answer<const N: usize>(&self, block: &CableBlock, motion: &[F; 3], own: &mut [F]) {
        let right: [F; N] = std::array::from_fn(|c| {
            let by = &block.rates_by_motion[c];
            own[c] + motion[0].scale(by[0]) + motion[1].scale(by[1]) + motion[2].scale(by[2])
        });
        for r in 0..N {
            let mut sum = F::zero();
            for c in 0..N {
                sum += self.inverse[r][c] * right[c];
            }
            own[r] = sum;
        }
    }
}

/// Inverse of `σ I - C` by Gauss-Jordan. No pivoting: the diagonal is `σ` plus decay rates, and the spring's entry has
/// the sign that adds to it.
fn invert<F: Field>(block: &CableBlock, sigma: F, inverse: &mut [[F; BLOCK]; BLOCK]) {
    let n = block.size;
    let mut m = [[F::zero(); BLOCK]; BLOCK];
    for r in 0..n {
        for c in 0..n {
            let unit = if r == c { (sigma, F::one()) } else { (F::zero(), F::zero()) };
            m[r][c] = unit.0 - F::from(block.rates_by_state[r][c]);
            inverse[r][c] = unit.1;
        }
    }
    for p in 0..n {
        let scale = F::one() / m[p][p];
        for c in 0..n {
            m[p][c] *= scale;
            inverse[p][c] *= scale;
        }
        for r in 0..n {
            if r != p {
                let factor = m[r][p];
                for c in 0..n {
                    let (a, b) = (m[p][c], inverse[p][c]);
                    m[r][c] -= factor * a;
                    inverse[r][c] -= factor * b;
                }
            }
        }
    }
}
