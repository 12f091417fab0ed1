//! SUNDIALS in C: ARKODE's Dormand and Prince, CVODE's Adams and BDF, IDA by itself and with a Jacobian by hand, each started anew
//! at every communication step.

use std::ffi::{c_int, c_long, c_void};
use std::ptr;

use sundials_sys::{
    CV_ADAMS, CV_BDF, CV_NORMAL, CVode, CVodeCreate, CVodeFree, CVodeInit, CVodeReInit, CVodeSVtolerances,
    CVodeSetLinearSolver, CVodeSetMaxNumSteps, CVodeSetNonlinearSolver, CVodeSetStopTime, CVodeSetUserData, IDA_NORMAL,
    IDACreate, IDAFree, IDAInit, IDAReInit, IDASVtolerances, IDASetJacFn, IDASetLinearSolver, IDASetMaxNumSteps,
    IDASetStopTime, IDASetUserData, IDASolve, N_VDestroy, N_VGetArrayPointer, N_VNew_Serial, N_Vector, SUN_COMM_NULL,
    SUNContext, SUNContext_Create, SUNContext_Free, SUNDenseMatrix, SUNDenseMatrix_Data, SUNLinSol_Dense,
    SUNLinSolFree, SUNLinearSolver, SUNMatDestroy, SUNMatrix, SUNNonlinSol_FixedPoint, SUNNonlinSolFree,
    SUNNonlinearSolver,
};

use crate::case::Case;
use crate::race::{Entrant, Feed, Method, thread_time};
use crate::rates::Rates;

type RatesFn = unsafe extern "C" fn(f64, N_Vector, N_Vector, *mut c_void) -> c_int;

// The crate builds ARKODE and has no declarations of it; these are from SUNDIALS 7.1's arkode.h and arkode_erkstep.h.
unsafe extern "C" {
    fn ERKStepCreate(rates: RatesFn, t0: f64, y0: N_Vector, context: SUNContext) -> *mut c_void;
    fn ERKStepReset(memory: *mut c_void, time: f64, y: N_Vector) -> c_int;
    fn ERKStepSetTableName(memory: *mut c_void, table: *const std::ffi::c_char) -> c_int;
    fn ARKodeSVtolerances(memory: *mut c_void, relative: f64, absolute: N_Vector) -> c_int;
    fn ARKodeSetUserData(memory: *mut c_void, data: *mut c_void) -> c_int;
    fn ARKodeSetStopTime(memory: *mut c_void, time: f64) -> c_int;
    fn ARKodeSetInitStep(memory: *mut c_void, step: f64) -> c_int;
    fn ARKodeSetMaxNumSteps(memory: *mut c_void, steps: c_long) -> c_int;
    fn ARKodeGetLastStep(memory: *mut c_void, step: *mut f64) -> c_int;
    fn ARKodeGetEstLocalErrors(memory: *mut c_void, errors: N_Vector) -> c_int;
    fn ARKodeEvolve(memory: *mut c_void, until: f64, y: N_Vector, reached: *mut f64, task: c_int) -> c_int;
    fn ARKodeFree(memory: *mut *mut c_void);
}

const ARK_NORMAL: c_int = 1;
/// Steps that one communication step may take.
const STEPS: c_long = 1_000_000;

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    DormandPrince,
    Adams,
    Bdf,
    /// Its Jacobian by differences.
    Ida,
    /// The plant's own derivatives for a Jacobian.
    IdaByHand,
}

impl Kind {
    fn is_ida(self) -> bool {
        matches!(self, Self::Ida | Self::IdaByHand)
    }
}

struct Peer {
    kind: Kind,
    tolerance: f64,
}

/// Everything that SUNDIALS has to be handed back.
struct Memory {
    kind: Kind,
    context: SUNContext,
    solver: *mut c_void,
    y: N_Vector,
    slopes: N_Vector,
    weights: N_Vector,
    matrix: SUNMatrix,
    linear: SUNLinearSolver,
    nonlinear: SUNNonlinearSolver,
    /// At an address of its own, which SUNDIALS keeps.
    rates: Box<Rates>,
    count: usize,
}

/// # Safety
/// `vector` has `count` values that nobody else looks at meanwhile.
unsafe fn values<'a>(vector: N_Vector, count: usize) -> &'a mut [f64] {
    // SAFETY: the caller's promise.
    unsafe { std::slice::from_raw_parts_mut(N_VGetArrayPointer(vector), count) }
}

unsafe extern "C" fn rates(t: f64, y: N_Vector, out: N_Vector, data: *mut c_void) -> c_int {
    // SAFETY: `data` is what was handed in: the rates, which outlive the solver. The vectors have as many values as the plant states.
    unsafe {
        let rates = &mut *data.cast::<Rates>();
        let count = sundials_sys::N_VGetLength(y) as usize;
        rates.at(t, values(y, count), values(out, count));
    }
    0
}

/// `ẏ - f(t, y)`.
unsafe extern "C" fn residual(t: f64, y: N_Vector, slopes: N_Vector, out: N_Vector, data: *mut c_void) -> c_int {
    // SAFETY: as above.
    unsafe {
        rates(t, y, out, data);
        let count = sundials_sys::N_VGetLength(y) as usize;
        for (out, slope) in values(out, count).iter_mut().zip(values(slopes, count)) {
            *out = *slope - *out;
        }
    }
    0
}

/// `c I - ∂f/∂y`, by columns.
unsafe extern "C" fn jacobian(
    t: f64,
    c: f64,
    y: N_Vector,
    _slopes: N_Vector,
    _residual: N_Vector,
    matrix: SUNMatrix,
    data: *mut c_void,
    _: N_Vector,
    _: N_Vector,
    _: N_Vector,
) -> c_int {
    // SAFETY: as above; the matrix is dense, with a row and a column for each state, and nobody else looks at it meanwhile.
    unsafe {
        let rates = &mut *data.cast::<Rates>();
        let count = sundials_sys::N_VGetLength(y) as usize;
        let derivatives = rates.derivatives(t, values(y, count));
        let entries = std::slice::from_raw_parts_mut(SUNDenseMatrix_Data(matrix), count * count);
        for (column, entries) in entries.chunks_exact_mut(count).enumerate() {
            for (row, entry) in entries.iter_mut().enumerate() {
                *entry = if row == column { c } else { 0.0 } - derivatives[row * count + column];
            }
        }
    }
    0
}

fn done(what: &str, flag: c_int) -> Result<(), String> {
    if flag >= 0 { Ok(()) } else { Err(format!("{what} failed ({flag})")) }
}

impl Memory {
    fn new(case: &Case, kind: Kind, tolerance: f64) -> Result<Self, String> {
        let mut rates_of = Box::new(Rates::new(case));
        let count = case.states().len();
        let mut context = ptr::null_mut();
        // SAFETY: SUNDIALS' own calls in the order of its manual, on vectors of the plant's size.
        unsafe {
            done("SUNContext_Create", SUNContext_Create(SUN_COMM_NULL, &raw mut context))?;
            let vector = || N_VNew_Serial(count as _, context);
            let (y, slopes, weights) = (vector(), vector(), vector());
            values(y, count).copy_from_slice(case.states());
            for (weight, size) in values(weights, count).iter_mut().zip(case.nominal()) {
                *weight = size * tolerance;
            }
            let data = ptr::from_mut(&mut *rates_of).cast();
            let dense = kind == Kind::Bdf || kind.is_ida();
            let matrix = if dense { SUNDenseMatrix(count as _, count as _, context) } else { ptr::null_mut() };
            let linear = if dense { SUNLinSol_Dense(y, matrix, context) } else { ptr::null_mut() };
            let mut nonlinear = ptr::null_mut();
            let solver = match kind {
                Kind::DormandPrince => {
                    let solver = ERKStepCreate(rates, 0.0, y, context);
                    done("table", ERKStepSetTableName(solver, c"ARKODE_DORMAND_PRINCE_7_4_5".as_ptr()))?;
                    done("tolerances", ARKodeSVtolerances(solver, 0.0, weights))?;
                    ARKodeSetUserData(solver, data);
                    ARKodeSetMaxNumSteps(solver, STEPS);
                    solver
                }
                Kind::Adams | Kind::Bdf => {
                    let solver = CVodeCreate(if kind == Kind::Bdf { CV_BDF } else { CV_ADAMS }, context);
                    done("CVodeInit", CVodeInit(solver, Some(rates), 0.0, y))?;
                    done("tolerances", CVodeSVtolerances(solver, 0.0, weights))?;
                    CVodeSetUserData(solver, data);
                    CVodeSetMaxNumSteps(solver, STEPS);
                    if kind == Kind::Bdf {
                        done("linear solver", CVodeSetLinearSolver(solver, linear, matrix))?;
                    } else {
                        nonlinear = SUNNonlinSol_FixedPoint(y, 0, context);
                        done("nonlinear solver", CVodeSetNonlinearSolver(solver, nonlinear))?;
                    }
                    solver
                }
                Kind::Ida | Kind::IdaByHand => {
                    let solver = IDACreate(context);
                    rates_of.at(0.0, case.states(), values(slopes, count));
                    done("IDAInit", IDAInit(solver, Some(residual), 0.0, y, slopes))?;
                    done("tolerances", IDASVtolerances(solver, 0.0, weights))?;
                    IDASetUserData(solver, data);
                    IDASetMaxNumSteps(solver, STEPS);
                    done("linear solver", IDASetLinearSolver(solver, linear, matrix))?;
                    if kind == Kind::IdaByHand {
                        done("Jacobian", IDASetJacFn(solver, Some(jacobian)))?;
                    }
                    solver
                }
            };
            Ok(Self { kind, context, solver, y, slopes, weights, matrix, linear, nonlinear, rates: rates_of, count })
        }
    }

    /// Starts anew at `time` and goes on to `end` (s).
    fn advance(&mut self, time: f64, end: f64) -> Result<(), String> {
        let Self { kind, solver, y, slopes, count, .. } = *self;
        let mut reached = 0.0;
        // SAFETY: the solver and its vectors are there until they are dropped.
        unsafe {
            match kind {
                Kind::DormandPrince => {
                    // The cheapest way to begin anew. It goes on with the step that its last error asks for (what ARKODE itself
                    // proposes is cut off at the stop time), without a tiny one at the end; the first one is its own guess.
                    let mut next = 0.0;
                    if time > 0.0 {
                        done("last step", ARKodeGetLastStep(solver, &raw mut next))?;
                        done("errors", ARKodeGetEstLocalErrors(solver, slopes))?;
                        let pairs = values(slopes, count).iter().zip(values(self.weights, count));
                        let sum: f64 = pairs.map(|(error, weight)| (*error / *weight).powi(2)).sum();
                        next *= 0.9 * (sum / count as f64).sqrt().max(1e-10).powf(-0.2);
                        next = if next > 0.9 * (end - time) { end - time } else { next };
                    }
                    done("ERKStepReset", ERKStepReset(solver, time, y))?;
                    done("first step", ARKodeSetInitStep(solver, next))?;
                    done("stop time", ARKodeSetStopTime(solver, end))?;
                    done("ARKodeEvolve", ARKodeEvolve(solver, end, y, &raw mut reached, ARK_NORMAL))
                }
                Kind::Adams | Kind::Bdf => {
                    done("CVodeReInit", CVodeReInit(solver, time, y))?;
                    done("stop time", CVodeSetStopTime(solver, end))?;
                    done("CVode", CVode(solver, end, y, &raw mut reached, CV_NORMAL))
                }
                Kind::Ida | Kind::IdaByHand => {
                    self.rates.at(time, values(y, count), values(slopes, count));
                    done("IDAReInit", IDAReInit(solver, time, y, slopes))?;
                    done("stop time", IDASetStopTime(solver, end))?;
                    done("IDASolve", IDASolve(solver, end, &raw mut reached, y, slopes, IDA_NORMAL))
                }
            }
        }
    }
}

impl Drop for Memory {
    fn drop(&mut self) {
        // SAFETY: each was made above and is freed once, the context last.
        unsafe {
            match self.kind {
                Kind::DormandPrince => ARKodeFree(&raw mut self.solver),
                Kind::Adams | Kind::Bdf => CVodeFree(&raw mut self.solver),
                Kind::Ida | Kind::IdaByHand => IDAFree(&raw mut self.solver),
            }
            if !self.linear.is_null() {
                SUNLinSolFree(self.linear);
                SUNMatDestroy(self.matrix);
            }
            if !self.nonlinear.is_null() {
                SUNNonlinSolFree(self.nonlinear);
            }
            [self.y, self.slopes, self.weights].into_iter().for_each(|vector| N_VDestroy(vector));
            SUNContext_Free(&raw mut self.context);
        }
    }
}

impl Method for Peer {
    fn run(&self, case: &Case, feed: &mut Feed<'_>) -> Result<f64, String> {
        let mut memory = Memory::new(case, self.kind, self.tolerance)?;
        let begun = thread_time();
        let mut k = 0;
        // SAFETY: nobody else looks at the vector meanwhile.
        while let Some(inputs) = feed(k, unsafe { values(memory.y, memory.count) }) {
            memory.rates.inputs = inputs;
            memory.advance(k as f64 * case.step, (k + 1) as f64 * case.step)?;
            k += 1;
        }
        Ok(thread_time() - begun)
    }
}

pub(crate) fn entrants(_case: &Case) -> Vec<Entrant<'_>> {
    let kinds: [(&str, Kind, &[f64]); 5] = [
        ("ARKODE Dormand-Prince", Kind::DormandPrince, &[1e-6, 1e-8, 1e-10, 1e-12]),
        ("CVODE Adams", Kind::Adams, &[1e-6, 1e-8, 1e-10]),
        ("CVODE BDF", Kind::Bdf, &[1e-6, 1e-8, 1e-10]),
        ("IDA", Kind::Ida, &[1e-6, 1e-8, 1e-10]),
        ("IDA, Jacobian by hand", Kind::IdaByHand, &[1e-6, 1e-8, 1e-10, 1e-12]),
    ];
    let entrant = |name: &str, kind, tolerance| Entrant {
        name: name.to_owned(),
        tolerance,
        method: Box::new(Peer { kind, tolerance }) as Box<dyn Method>,
    };
    kinds
        .iter()
        .flat_map(|(name, kind, list)| list.iter().map(move |tolerance| entrant(name, *kind, *tolerance)))
        .collect()
}
