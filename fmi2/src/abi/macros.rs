//! The macro that gives the functions their C names.

/// Export a [`Model`](crate::Model) from a `cdylib` crate as an FMI 2.0 co-simulation FMU.
///
/// Call it once, in the crate whose library becomes the FMU's binary:
///
/// ```ignore
/// fmi2_export::export!(my_model::MyModel);
/// ```
///
/// It defines the 34 functions of the standard. Build the crate with unwinding panics (the default),
/// since a panic of the model could not be caught otherwise.
#[macro_export]
macro_rules! export {
    ($model:ty) => {
        $crate::__export_functions! { $model;
            fmi2SetDebugLogging = set_debug_logging(on: Boolean, n: usize, names: *const String);
            fmi2SetupExperiment = setup_experiment(
                tolerance_defined: Boolean, tolerance: Real, start: Real,
                stop_defined: Boolean, stop: Real);
            fmi2EnterInitializationMode = enter_initialization_mode();
            fmi2ExitInitializationMode = exit_initialization_mode();
            fmi2Terminate = terminate();
            fmi2Reset = reset();
            fmi2GetReal = get_real(vr: *const ValueReference, n: usize, value: *mut Real);
            fmi2GetInteger = get_integer(vr: *const ValueReference, n: usize, value: *mut Integer);
            fmi2GetBoolean = get_boolean(vr: *const ValueReference, n: usize, value: *mut Boolean);
            fmi2GetString = get_string(vr: *const ValueReference, n: usize, value: *mut String);
            fmi2SetReal = set_real(vr: *const ValueReference, n: usize, value: *const Real);
            fmi2SetInteger = set_integer(vr: *const ValueReference, n: usize, value: *const Integer);
            fmi2SetBoolean = set_boolean(vr: *const ValueReference, n: usize, value: *const Boolean);
            fmi2SetString = set_string(vr: *const ValueReference, n: usize, value: *const String);
            fmi2GetFMUstate = get_fmu_state(state: *mut FmuState);
            fmi2SetFMUstate = set_fmu_state(state: FmuState);
            fmi2FreeFMUstate = free_fmu_state(state: *mut FmuState);
            fmi2SerializedFMUstateSize = serialized_fmu_state_size(
                state: FmuState, size: *mut usize);
            fmi2SerializeFMUstate = serialize_fmu_state(
                state: FmuState, bytes: *mut Byte, size: usize);
            fmi2DeSerializeFMUstate = de_serialize_fmu_state(
                bytes: *const Byte, size: usize, state: *mut FmuState);
            fmi2GetDirectionalDerivative = get_directional_derivative(
                unknowns: *const ValueReference, n_unknowns: usize,
                knowns: *const ValueReference, n_knowns: usize,
                seed: *const Real, result: *mut Real);
            fmi2SetRealInputDerivatives = set_real_input_derivatives(
                vr: *const ValueReference, n: usize, order: *const Integer, value: *const Real);
            fmi2GetRealOutputDerivatives = get_real_output_derivatives(
                vr: *const ValueReference, n: usize, order: *const Integer, value: *mut Real);
            fmi2DoStep = do_step(point: Real, step: Real, no_set_prior: Boolean);
            fmi2CancelStep = cancel_step();
            fmi2GetStatus = get_status(kind: Enumeration, value: *mut Enumeration);
            fmi2GetRealStatus = get_real_status(kind: Enumeration, value: *mut Real);
            fmi2GetIntegerStatus = get_integer_status(kind: Enumeration, value: *mut Integer);
            fmi2GetBooleanStatus = get_boolean_status(kind: Enumeration, value: *mut Boolean);
            fmi2GetStringStatus = get_string_status(kind: Enumeration, value: *mut String);
        }
    };
}

#[doc(hidden)]
#[macro_export]
macro_rules! __export_functions {
    ($model:ty; $($c_name:ident = $name:ident($($argument:ident: $type:ty),*);)*) => {
        // SAFETY of everything here: these are the definitions behind the standard's declarations; what
        // a host passes is checked in `abi`.
        #[allow(unsafe_code, non_snake_case, unreachable_pub)]
        const _: () = {
            use $crate::abi::*;

            static LIVE: Live<$model> = Live::new();

            #[unsafe(no_mangle)]
            pub extern "C" fn fmi2GetTypesPlatform() -> String {
                get_types_platform()
            }

            #[unsafe(no_mangle)]
            pub extern "C" fn fmi2GetVersion() -> String {
                get_version()
            }

            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi2Instantiate(
                instance_name: String,
                fmu_type: Enumeration,
                guid: String,
                resource_location: String,
                functions: *const CallbackFunctions,
                visible: Boolean,
                logging_on: Boolean,
            ) -> Component {
                // SAFETY: as FMI 2.0 has it.
                unsafe {
                    instantiate(
                        &LIVE, instance_name, fmu_type, guid, resource_location, functions, visible,
                        logging_on,
                    )
                }
            }

            #[unsafe(no_mangle)]
            pub extern "C" fn fmi2FreeInstance(component: Component) {
                free_instance(&LIVE, component)
            }

            $(
                #[unsafe(no_mangle)]
                pub unsafe extern "C" fn $c_name(
                    component: Component, $($argument: $type),*
                ) -> Enumeration {
                    // SAFETY: as FMI 2.0 has it.
                    unsafe { $name(&LIVE, component, $($argument),*) }
                }
            )*
        };
    };
}
