//! The factors of `σ I - ∂f/∂y`, the matrix of Newton's method, for a real and a complex `σ`, and the solution with them.
//!
//! Velocities are eliminated first (`Δq = (r_q + Δv)/σ`), then each cable's own block; what remains is one 3×3 system
//! in `Δv`. Nothing but the factors is read in a solution, and they lie together: they are most of what an instance keeps warm.

use std::array::from_fn;
use std::ops::Range;

use num_complex::Complex64;

use super::columns::{Column, LANES, Lanes, Pairs, Place, Reals, Split, dot, times};
use super::linearisation::{BLOCK, CableBlock, Linearisation, StateBlock};
use super::matrix3::{self, Field, Matrix3};

/// The platform's part for one `σ`; matrices by columns.
#[derive(Clone, Debug)]
struct Platform<F, L> {
    sigma: F,
    inverse_sigma: F,
    schur_inverse: [L; 3],
    /// `∂(forces)/∂q` with the cables' answer, over `σ`, negative.
    pose_coupling: [L; 3],
}

/// Four cables' part for one `σ`, a lane for each. With `D = σ I - ∂f_c/∂c` over a cable's own states `c`:
#[derive(Clone, Copy, Debug)]
struct Own<L, const N: usize> {
    /// `D⁻¹`, by rows.
    inverse: [[L; N]; N],
    /// Row `∂T/∂c D⁻¹`.
    tension: [L; N],
    /// That times what the platform's acceleration along the cable does to the rates of `c`.
    tension_by_acceleration: L,
}

/// Four cables with up to `N` states; zero in lanes beyond the last one, and beyond a cable's last state.
#[derive(Clone, Debug)]
struct Group<const N: usize> {
    place: Place,
    row: [Reals; 3],
    rates_by_pose: [[Reals; N]; 3],
    rates_by_twist: [[Reals; N]; 3],
    real: Own<Reals, N>,
    complex: Own<Pairs, N>,
    rates_by_acceleration: [Reals; N],
    /// Whether the platform reaches the rates of these states directly; that of a length is a state itself.
    reached: [bool; N],
}

/// The cables, with room for the most states that one of them has.
#[derive(Clone, Debug)]
enum Cables {
    None(Vec<Group<0>>),
    One(Vec<Group<1>>),
    Two(Vec<Group<2>>),
    Three(Vec<Group<3>>),
    Four(Vec<Group<4>>),
    Most(Vec<Group<BLOCK>>),
}

/// What all cables have in common.
#[derive(Clone, Debug)]
struct Common {
    /// By columns.
    mass: [Reals; 3],
    real: Platform<f64, Reals>,
    complex: Platform<Complex64, Pairs>,
    /// Whether the platform's acceleration acts on states of the cables directly.
    by_acceleration: bool,
}

/// `(σ I - ∂f/∂y)⁻¹` for a real and a complex `σ`.
#[derive(Clone, Debug)]
pub(crate) struct Factors {
    common: Common,
    cables: Cables,
}

/// Runs `$body` with the cables, whatever their room.
macro_rules! with_cables {
    ($cables:expr, $list:ident => $body:expr) => {
        match $cables {
            Cables::None($list) => $body,
            Cables::One($list) => $body,
            Cables::Two($list) => $body,
            Cables::Three($list) => $body,
            Cables::Four($list) => $body,
            Cables::Most($list) => $body,
        }
    };
}

impl Factors {
    /// Room for the factors of cables that have these `states`.
    pub(crate) fn new(states: &[Range<usize>]) -> Self {
        let cables = match states.iter().map(Range::len).max().unwrap_or(0) {
            0 => Cables::None(Group::all(states)),
            1 => Cables::One(Group::all(states)),
            2 => Cables::Two(Group::all(states)),
            3 => Cables::Three(Group::all(states)),
            4 => Cables::Four(Group::all(states)),
            _ => Cables::Most(Group::all(states)),
        };
        let common = Common {
            mass: [Reals::ZERO; 3],
            real: Platform::empty(),
            complex: Platform::empty(),
            by_acceleration: false,
        };
        Self { common, cables }
    }

    /// Factors the linearisation at `real` and at `complex`.
    pub(crate) fn update(&mut self, linearisation: &Linearisation, real: f64, complex: Complex64) {
        let acts = |block: &CableBlock| block.states.iter().any(|state| state.rate_by_acceleration != 0.0);
        self.common.by_acceleration = linearisation.cables.iter().any(acts);
        self.common.mass = columns(&linearisation.mass);
        with_cables!(&mut self.cables, cables => {
            cables.iter_mut().for_each(|group| group.reached.fill(false));
            for (i, block) in linearisation.cables.iter().enumerate() {
                cables[i / LANES].take_up(i % LANES, block);
            }
            self.common.real = factor(linearisation, real, cables, |group| &mut group.real);
            self.common.complex = factor(linearisation, complex, cables, |group| &mut group.complex);
        });
    }

    /// Solves `(σ I - ∂f/∂y) x = b` in place for the real `σ`.
    #[inline]
    pub(crate) fn solve_real(&self, b: &mut [f64]) {
        let common = &self.common;
        with_cables!(&self.cables, cables => common.solve(&common.real, cables, |group| &group.real, b));
    }

    /// The same for the complex `σ`, of real and imaginary parts.
    #[inline]
    pub(crate) fn solve_complex(&self, re: &mut [f64], im: &mut [f64]) {
        let (common, b) = (&self.common, &mut Split { re, im });
        with_cables!(&self.cables, cables => common.solve(&common.complex, cables, |group| &group.complex, b));
    }
}

impl Common {
    #[inline]
    fn solve<F: Field, C: Column<F> + ?Sized, const N: usize>(
        &self,
        platform: &Platform<F, C::Lanes>,
        groups: &[Group<N>],
        own: impl Fn(&Group<N>) -> &Own<C::Lanes, N>,
        b: &mut C,
    ) {
        let spread = |vector: C::Lanes| from_fn(|k| C::Lanes::spread(vector.get(k)));
        let (rq, rv) = (b.three(0), b.three(3));
        let twist: [C::Lanes; 3] = spread(rv);
        let mut wrench = [C::Lanes::ZERO; 3];
        for group in groups {
            let own = own(group);
            let mut tension = dot(&own.tension, &b.gather(&group.place));
            if self.by_acceleration {
                tension = tension - own.tension_by_acceleration * group.along(&twist);
            }
            wrench = from_fn(|k| wrench[k] + tension.scale(group.row[k]));
        }
        let mut pulled = C::Lanes::ZERO;
        for k in 0..3 {
            pulled.set(k, wrench[k].sum());
        }
        let inertial = twist[0].scale(self.mass[0]) + twist[1].scale(self.mass[1]) + twist[2].scale(self.mass[2]);
        let dv = times(&platform.schur_inverse, inertial - times(&platform.pose_coupling, rq) - pulled);
        let dq = (rq + dv) * C::Lanes::spread(platform.inverse_sigma);
        let (pose, twist) = (spread(dq), spread(dv));
        for group in groups {
            let mut right: [C::Lanes; N] = b.gather(&group.place);
            if self.by_acceleration {
                // The acceleration's own change is σ Δv less its right-hand side.
                let along: C::Lanes = group.along(&spread(dv * C::Lanes::spread(platform.sigma) - rv));
                right = from_fn(|c| right[c] + along.scale(group.rates_by_acceleration[c]));
            }
            for c in (0..N).filter(|c| group.reached[*c]) {
                let by =
                    |k: usize| pose[k].scale(group.rates_by_pose[k][c]) + twist[k].scale(group.rates_by_twist[k][c]);
                right[c] = right[c] + (by(0) + by(1) + by(2));
            }
            let inverse = &own(group).inverse;
            b.scatter(&group.place, &from_fn::<_, N, _>(|r| dot(&inverse[r], &right)));
        }
        b.set_three(0, dq);
        b.set_three(3, dv);
    }
}

/// The columns of a matrix over the platform's three axes.
fn columns<F: Copy, L: Lanes<F>>(matrix: &Matrix3<F>) -> [L; 3] {
    from_fn(|c| {
        let mut column = L::ZERO;
        (0..3).for_each(|r| column.set(r, matrix[r][c]));
        column
    })
}

impl<F: Field, L: Lanes<F>> Platform<F, L> {
    fn empty() -> Self {
        Self { sigma: F::zero(), inverse_sigma: F::zero(), schur_inverse: [L::ZERO; 3], pose_coupling: [L::ZERO; 3] }
    }
}

impl<L, const N: usize> Own<L, N> {
    fn zero<F>() -> Self
    where
        L: Lanes<F>,
    {
        Self { inverse: [[L::ZERO; N]; N], tension: [L::ZERO; N], tension_by_acceleration: L::ZERO }
    }
}

impl<const N: usize> Group<N> {
    /// Groups of all cables, which have these states.
    fn all(states: &[Range<usize>]) -> Vec<Self> {
        let group = |states| Self {
            place: Place::new(states, N),
            row: [Reals::ZERO; 3],
            rates_by_pose: [[Reals::ZERO; N]; 3],
            rates_by_twist: [[Reals::ZERO; N]; 3],
            real: Own::zero(),
            complex: Own::zero(),
            rates_by_acceleration: [Reals::ZERO; N],
            reached: [false; N],
        };
        states.chunks(LANES).map(group).collect()
    }

    /// What does not depend on `σ`, of the cable in `lane`.
    fn take_up(&mut self, lane: usize, block: &CableBlock) {
        for k in 0..3 {
            self.row[k].set(lane, block.row[k]);
        }
        for (c, state) in block.states.iter().enumerate().take(N) {
            for k in 0..3 {
                self.rates_by_pose[k][c].set(lane, state.rate_by_pose[k]);
                self.rates_by_twist[k][c].set(lane, state.rate_by_twist[k]);
            }
            self.rates_by_acceleration[c].set(lane, state.rate_by_acceleration);
            let by_platform = state.rate_by_pose.iter().chain(&state.rate_by_twist);
            self.reached[c] |= by_platform.into_iter().any(|by| *by != 0.0);
        }
    }

    /// The cables' rows times a vector.
    #[inline(always)]
    fn along<F, L: Lanes<F>>(&self, vector: &[L; 3]) -> L {
        vector[0].scale(self.row[0]) + vector[1].scale(self.row[1]) + vector[2].scale(self.row[2])
    }
}

/// Factors the linearisation at `sigma`: the cables' parts into `cables`, and the platform's.
fn factor<F: Field, L: Lanes<F>, const N: usize>(
    linearisation: &Linearisation,
    sigma: F,
    groups: &mut [Group<N>],
    own: impl Fn(&mut Group<N>) -> &mut Own<L, N>,
) -> Platform<F, L> {
    let mut schur: Matrix3<F> =
        from_fn(|r| from_fn(|c| sigma.scale(linearisation.mass[r][c]) - F::from(linearisation.force_by_twist[r][c])));
    let mut pose_coupling = linearisation.force_by_pose.map(|row| row.map(|v| F::from(-v)));
    for (i, block) in linearisation.cables.iter().enumerate() {
        let states = &block.states[..block.states.len().min(N)];
        let inverse: [[F; N]; N] = invert(states, sigma);
        // The tension's answer to own states, pose, twist, and acceleration along the cable.
        let mut tension = [F::zero(); N];
        let (mut by_pose, mut by_twist) = ([F::zero(); 3], [F::zero(); 3]);
        let mut by_acceleration = F::zero();
        for (c, state) in states.iter().enumerate() {
            let mut sum = F::zero();
            for (r, other) in states.iter().enumerate() {
                sum += inverse[r][c].scale(other.tension);
            }
            tension[c] = sum;
            for k in 0..3 {
                by_pose[k] += sum.scale(state.rate_by_pose[k]);
                by_twist[k] += sum.scale(state.rate_by_twist[k]);
            }
            by_acceleration += sum.scale(state.rate_by_acceleration);
        }
        let (own, lane) = (own(&mut groups[i / LANES]), i % LANES);
        for c in 0..N {
            own.tension[c].set(lane, tension[c]);
            for r in 0..N {
                own.inverse[r][c].set(lane, inverse[r][c]);
            }
        }
        own.tension_by_acceleration.set(lane, by_acceleration);
        let row = block.row.map(F::from);
        for k in 0..3 {
            by_twist[k] += sigma * by_acceleration * row[k];
        }
        matrix3::add_outer(&mut pose_coupling, &row, &by_pose, F::one());
        matrix3::add_outer(&mut schur, &row, &by_twist, F::one());
    }
    let inverse_sigma = F::one() / sigma;
    for r in 0..3 {
        for c in 0..3 {
            pose_coupling[r][c] *= inverse_sigma;
            schur[r][c] += pose_coupling[r][c];
        }
    }
    let (schur_inverse, pose_coupling) = (columns(&matrix3::inverse(&schur)), columns(&pose_coupling));
    Platform { sigma, inverse_sigma, schur_inverse, pose_coupling }
}

/// Inverse of `σ I - C` over a cable's states by Gauss-Jordan, two states in closed form. No pivoting: the diagonal is `σ`
/// plus decay rates, and the spring's entry has the sign that adds to it.
fn invert<F: Field, const N: usize>(states: &[StateBlock], sigma: F) -> [[F; N]; N] {
    let n = states.len();
    let mut inverse = [[F::zero(); N]; N];
    if n == 2 {
        let [[a, b], [c, d]] = [0, 1].map(|r| [0, 1].map(|c| F::from(-states[r].rate_by_state[c])));
        let (a, d) = (a + sigma, d + sigma);
        let scale = F::one() / (a * d - b * c);
        inverse[0][..2].copy_from_slice(&[d * scale, -b * scale]);
        inverse[1][..2].copy_from_slice(&[-c * scale, a * scale]);
        return inverse;
    }
    let mut m = [[F::zero(); N]; N];
    for r in 0..n {
        for c in 0..n {
            let unit = if r == c { (sigma, F::one()) } else { (F::zero(), F::zero()) };
            m[r][c] = unit.0 - F::from(states[r].rate_by_state[c]);
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
    inverse
}
