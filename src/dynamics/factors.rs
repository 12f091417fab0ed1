//! The factors of `σ I - ∂f/∂y`, the matrix of Newton's method, for a real and a complex `σ`, and the solution with them.
//!
//! Velocities are eliminated first (`Δq = (r_q + Δv)/σ`), then each cable's own block; what remains is one 3×3 system
//! in `Δv`. Nothing but the factors is read in a solution, and they lie together: they are most of what an instance keeps warm.

use std::array::from_fn;
use std::ops::Range;

use num_complex::Complex64;

use super::columns::{Column, LANES, Lanes, Pairs, Place, Reals, Split, dot, times};
use super::linearisation::{BLOCK, CableBlock, Linearisation};
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
        let mut of_real = Elimination::new(linearisation, real);
        let mut of_complex = Elimination::new(linearisation, complex);
        with_cables!(&mut self.cables, groups => {
            for (group, blocks) in groups.iter_mut().zip(linearisation.cables.chunks(LANES)) {
                group.take_up(blocks);
                let states = OwnStates::of(blocks);
                group.real = of_real.take_up(group, &states);
                group.complex = of_complex.take_up(group, &states);
            }
        });
        (self.common.real, self.common.complex) = (of_real.platform(), of_complex.platform());
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

    /// What does not depend on `σ`.
    fn take_up(&mut self, blocks: &[CableBlock]) {
        self.reached.fill(false);
        for (lane, block) in blocks.iter().enumerate() {
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
    }

    /// The cables' rows times a vector.
    #[inline(always)]
    fn along<F, L: Lanes<F>>(&self, vector: &[L; 3]) -> L {
        vector[0].scale(self.row[0]) + vector[1].scale(self.row[1]) + vector[2].scale(self.row[2])
    }
}

/// What four cables' own states do to each other and to the tension; zero in lanes beyond the last one, and beyond a cable's last
/// state.
struct OwnStates<const N: usize> {
    /// `∂f_c/∂c`.
    rate_by_state: [[Reals; N]; N],
    /// `∂T/∂c`.
    tension: [Reals; N],
    /// The most that one of them has.
    count: usize,
}

impl<const N: usize> OwnStates<N> {
    fn of(blocks: &[CableBlock]) -> Self {
        let mut states = Self { rate_by_state: [[Reals::ZERO; N]; N], tension: [Reals::ZERO; N], count: 0 };
        for (lane, block) in blocks.iter().enumerate() {
            let count = block.states.len().min(N);
            states.count = states.count.max(count);
            for (r, state) in block.states[..count].iter().enumerate() {
                states.tension[r].set(lane, state.tension);
                for c in 0..count {
                    states.rate_by_state[r][c].set(lane, state.rate_by_state[c]);
                }
            }
        }
        states
    }

    /// `(σ I - ∂f_c/∂c)⁻¹` by Gauss-Jordan, two states in closed form. No pivoting: the diagonal is `σ` plus decay rates, and the
    /// spring's entry has the sign that adds to it.
    fn inverse<F: Field, L: Lanes<F>>(&self, sigma: F) -> [[L; N]; N] {
        let n = self.count;
        let by = |r: usize, c: usize| L::lift(self.rate_by_state[r][c]);
        let mut inverse = [[L::ZERO; N]; N];
        if n == 2 {
            let (a, d) = (L::spread(sigma) - by(0, 0), L::spread(sigma) - by(1, 1));
            let scale = (a * d - by(0, 1) * by(1, 0)).recip();
            inverse[0][..2].copy_from_slice(&[d * scale, by(0, 1) * scale]);
            inverse[1][..2].copy_from_slice(&[by(1, 0) * scale, a * scale]);
            return inverse;
        }
        let mut m = [[L::ZERO; N]; N];
        for r in 0..n {
            for c in 0..n {
                let sigma = if r == c { L::spread(sigma) } else { L::ZERO };
                m[r][c] = sigma - by(r, c);
            }
            inverse[r][r] = L::spread(F::one());
        }
        for p in 0..n {
            let scale = m[p][p].recip();
            for c in 0..n {
                m[p][c] = m[p][c] * scale;
                inverse[p][c] = inverse[p][c] * scale;
            }
            for r in (0..n).filter(|r| *r != p) {
                let factor = m[r][p];
                for c in 0..n {
                    m[r][c] = m[r][c] - factor * m[p][c];
                    inverse[r][c] = inverse[r][c] - factor * inverse[p][c];
                }
            }
        }
        inverse
    }
}

/// The platform's equations for one `σ` as the cables' states are eliminated from them.
struct Elimination<F> {
    sigma: F,
    schur: Matrix3<F>,
    pose_coupling: Matrix3<F>,
}

impl<F: Field> Elimination<F> {
    fn new(linearisation: &Linearisation, sigma: F) -> Self {
        let Linearisation { mass, force_by_pose, force_by_twist, .. } = linearisation;
        let schur = from_fn(|r| from_fn(|c| sigma.scale(mass[r][c]) - F::from(force_by_twist[r][c])));
        Self { sigma, schur, pose_coupling: force_by_pose.map(|row| row.map(|v| F::from(-v))) }
    }

    /// Takes up four cables. Returns their part.
    fn take_up<L: Lanes<F>, const N: usize>(&mut self, group: &Group<N>, states: &OwnStates<N>) -> Own<L, N> {
        let inverse: [[L; N]; N] = states.inverse(self.sigma);
        // The tension's answer to own states, to pose and twist through their rates, and to the acceleration along the cable.
        let weighed = |values: &[L; N], weights: &[Reals; N]| {
            (0..states.count).fold(L::ZERO, |sum, c| sum + values[c].scale(weights[c]))
        };
        let tension: [L; N] = from_fn(|c| weighed(&from_fn(|r| inverse[r][c]), &states.tension));
        let tension_by_acceleration = weighed(&tension, &group.rates_by_acceleration);
        let by_acceleration = tension_by_acceleration * L::spread(self.sigma);
        for c in 0..3 {
            let by_pose = weighed(&tension, &group.rates_by_pose[c]);
            let by_twist = weighed(&tension, &group.rates_by_twist[c]) + by_acceleration.scale(group.row[c]);
            for r in 0..3 {
                self.pose_coupling[r][c] += by_pose.scale(group.row[r]).sum();
                self.schur[r][c] += by_twist.scale(group.row[r]).sum();
            }
        }
        Own { inverse, tension, tension_by_acceleration }
    }

    fn platform<L: Lanes<F>>(mut self) -> Platform<F, L> {
        let inverse_sigma = F::one() / self.sigma;
        for r in 0..3 {
            for c in 0..3 {
                self.pose_coupling[r][c] *= inverse_sigma;
                self.schur[r][c] += self.pose_coupling[r][c];
            }
        }
        let schur_inverse = columns(&matrix3::inverse(&self.schur));
        Platform { sigma: self.sigma, inverse_sigma, schur_inverse, pose_coupling: columns(&self.pose_coupling) }
    }
}
