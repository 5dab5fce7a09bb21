//! What the suite claims, test by test.

/// One `#[test]` per claim of the suite; the argument is a [`Suite`](crate::backend::conformance::Suite). A backend
/// may say what a machine needs to test them, and one that does not have everything yet lists the claims that it answers for:
///
/// ```
/// use refraxel_train::CpuBackend;
/// use refraxel_train::backend::conformance::{Suite, Tolerances};
/// refraxel_train::conformance_tests! {
///     Suite { make: CpuBackend::new, tolerances: Tolerances::SINGLE_PRECISION }, ignore = "needs a certain device" =>
///         straight { rendering_agrees_with_the_reference, learning_lowers_the_loss }
///         contract { outcomes_come_in_order_and_once }
/// }
/// ```
#[macro_export]
macro_rules! conformance_tests {
    ($suite:expr) => {
        $crate::conformance_tests! { $suite, cfg(test) }
    };
    ($suite:expr, $attribute:meta) => {
        $crate::conformance_tests! { $suite, $attribute =>
            straight {
                rendering_agrees_with_the_reference,
                gradients_agree_with_the_reference,
                thinned_haze_has_the_reference_gradient,
                the_prior_on_samples_has_the_reference_gradient,
                samples_near_the_camera_move_the_field_by_their_share,
                cut_offs_change_a_picture_by_no_more_than_they_say,
                skipping_never_jumps_over_matter_in_flat_contracted_boxes,
                learning_lowers_the_loss,
                resampling_to_a_finer_grid_keeps_the_picture,
                peak_weights_mark_what_rays_see,
            }
            bent {
                bent_rendering_agrees_with_the_reference,
                sharp_rendering_agrees_with_the_reference,
                bent_gradients_agree_with_the_reference,
                sharp_gradients_agree_with_the_reference,
                surfaces_owe_nothing_for_rays_that_do_not_teach_them,
                gradients_of_rays_alone_are_the_same,
            }
            mirrored {
                mirroring_agrees_with_the_reference,
                bodies_in_bodies_refract_and_mirror_as_the_reference_does,
                soft_edges_mirror_as_the_reference_does,
                gradients_of_mirrors_and_of_what_lies_before_and_behind_match_central_differences,
                gradients_of_bodies_in_bodies_match_central_differences,
                gradients_of_soft_edges_that_mirror_match_central_differences,
                without_strength_a_picture_is_that_of_transmission,
                a_furnace_shows_one_colour_whatever_is_mirrored,
                secondary_rays_see_what_a_camera_at_the_surface_sees,
            }
            absorbing {
                absorbing_bodies_look_as_the_reference_says,
                gradients_of_absorbing_bodies_match_central_differences,
                gradients_of_absorbing_bodies_in_bodies_match_central_differences,
                clear_glass_that_may_learn_to_absorb_shows_and_teaches_the_same,
                tinted_glass_is_learned_from_pictures,
            }
            clearcoated {
                clearcoats_and_their_gradients_agree_with_the_reference,
                a_clearcoat_learns_and_its_pictures_come_nearer,
                between_equal_lights_a_clearcoat_is_invisible_and_in_the_dark_it_is_not,
                a_second_ray_from_a_clearcoat_starts_outside_of_what_it_coats,
                a_silent_clearcoat_can_come_back,
            }
            drawn {
                drawn_batches_teach_what_those_of_the_host_do,
                drawn_batches_bend_as_those_of_the_host_do,
                a_batch_without_pixels_is_told,
            }
            contract {
                a_loaded_snapshot_goes_on_as_if_nothing_had_happened,
                a_loaded_snapshot_of_straight_rays_goes_on_as_if_nothing_had_happened,
                a_loaded_snapshot_of_bent_rays_goes_on_as_if_nothing_had_happened,
                a_parameter_that_is_not_a_number_is_reported,
                after_a_failure_nothing_changes_until_the_next_load,
                a_gradient_changes_nothing,
                a_gradient_of_straight_rays_changes_nothing,
                a_gradient_of_bent_rays_changes_nothing,
                density_is_set_where_the_mask_says_and_its_moments_are_forgotten,
                baking_that_is_cancelled_changes_nothing,
                outcomes_come_in_order_and_once,
            }
        }
    };
    ($suite:expr, $attribute:meta => $($part:ident { $($claim:ident),* $(,)? })*) => {
        $(mod $part {
            use super::*;
            $(#[test]
            #[$attribute]
            fn $claim() {
                $crate::backend::conformance::$part::$claim(&$suite);
            })*
        })*
    };
}
