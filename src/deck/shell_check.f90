!> What a deck asks of shells that shells cannot do, or that they do in another way than solids.
module shell_check
  use text, only: to_text, rounded_text, counted
  use keyword_spec, only: is_among, list_entries
  use input_errors, only: error_list_t, add_error, add_warning
  use scene, only: scene_t, patch_spec_t
  use knot_vector, only: n_spans
  use deck_records, only: parsed_deck_t, find_records, option_text
  implicit none
  private

  public :: check_shell, check_shell_masses, check_shell_output, check_shell_viscosity

  integer, parameter :: least_layers = 4   ! fewer leave too much of the moment of a plastic sheet

contains

  !> Refuse what shells do not serve, and warn of rules that spoil their bending.
  subroutine check_shell(scene, errors)
    type(scene_t), intent(in) :: scene
    type(error_list_t), intent(inout) :: errors
    integer :: p, axis

    if (.not. scene%blank%is_shell) return
    do p = 1, size(scene%blank%patches)
      associate (patch => scene%blank%patches(p))
        if (any(patch%is_joined(5:6))) call add_error(errors, scene%blank%origin, "patch '"// &
          patch%name//"' on another one through the thickness, with ELEMENT=SHELL, where "// &
          "nothing joins them", "one patch for all of the thickness, or ELEMENT=SOLID")
        do axis = 1, 2
          call check_axis(scene, patch, axis, errors)
        end do
        call check_points(scene, patch, errors)
      end associate
    end do
  end subroutine check_shell

  !> A shell needs second derivatives to bend.
  subroutine check_axis(scene, patch, axis, errors)
    type(scene_t), intent(in) :: scene
    type(patch_spec_t), intent(in) :: patch
    integer, intent(in) :: axis                !! along the sheet
    type(error_list_t), intent(inout) :: errors

    associate (along => patch%solid%axes(axis))
      if (along%degree < 2) then
        ! A strip one element wide does not bend across.
        if (n_spans(along) > 1) call add_error(errors, scene%blank%origin, "degree 1 of '"// &
          patch%name//"' along axis "//to_text(axis)//" with ELEMENT=SHELL, which then cannot "// &
          "bend along it", "degree 2, or one element across a strip of plane strain")
      end if
    end associate
  end subroutine check_axis

  !> Points along the sheet, of which each sees three strains and three curvatures, and layers.
  subroutine check_points(scene, patch, errors)
    type(scene_t), intent(in) :: scene
    type(patch_spec_t), intent(in) :: patch
    type(error_list_t), intent(inout) :: errors
    integer, parameter :: seen = 6, moving = 3, rigid = 6
    integer :: n(3), spans(2), axis
    character(:), allocatable :: rule

    n = patch%n_points*patch%n_parts
    spans = [(n_spans(patch%solid%axes(axis)), axis=1, 2)]
    associate (axes => patch%solid%axes)
      rule = "a rule of "//to_text(n(1))//" x "//to_text(n(2))//" points along the sheet and "// &
             counted(n(3), "layer")//" with ELEMENT=SHELL"
      if (any(n(:2) < min(axes(:2)%degree, 2)) .or. &
          seen*product(spans*n(:2)) < moving*product(axes(:2)%n_basis) - rigid) then
        call add_error(errors, scene%blank%origin, rule//", which leaves deformations without "// &
                       "energy", "as many points as the degree along the sheet, such as "// &
                       "QUADRATURE=SHEET")
      else if (n(3) == 1) then
        call add_error(errors, scene%blank%origin, rule//", which does not resist bending", &
                       "at least "//to_text(least_layers)//" layers, such as QUADRATURE=SHEET")
      else if (n(3) < least_layers) then
        call add_warning(errors, scene%blank%origin, rule//", which miss a tenth and more of "// &
                         "the bending moment of a plastic sheet", "at least "// &
                         to_text(least_layers)//", better three in each half of the "// &
                         "thickness, such as QUADRATURE=SHEET")
      end if
      ! A single element needs the third point.
      if (product(spans) > 1 .and. any(axes(:2)%degree == 2 .and. n(:2) > 2)) &
        call add_warning(errors, scene%blank%origin, rule//" at degree 2, which locks: curved "// &
                         "sheets bend too little, a thin hemisphere of 16 x 16 elements by "// &
                         "15 %, of 8 x 8 by 74 %", "two points along axes of degree 2, such "// &
                         "as QUADRATURE=SHEET, or degree 3")
    end associate
  end subroutine check_points

  !> Refuse a viscosity of bending where it would do nothing.
  subroutine check_shell_viscosity(deck, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(scene_t), intent(in) :: scene
    type(error_list_t), intent(inout) :: errors
    integer, allocatable :: found(:)

    if (scene%blank%is_shell .or. .not. scene%step%viscosity_bending > 0) return
    found = find_records(deck, "BULK VISCOSITY")
    call add_error(errors, deck%records(found(1))%origin, "b3 = "// &
                   rounded_text(scene%step%viscosity_bending)//" with a blank of solid elements", &
                   "b1 and b2 alone, or ELEMENT=SHELL of *BLANK")
  end subroutine check_shell_viscosity

  !> Refuse output of a mid-surface where there is none.
  subroutine check_shell_output(deck, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(scene_t), intent(in) :: scene
    type(error_list_t), intent(inout) :: errors
    integer, allocatable :: found(:)
    integer :: i

    if (scene%blank%is_shell) return
    found = find_records(deck, "OUTPUT")
    do i = 1, size(found)
      associate (record => deck%records(found(i)))
        if (option_text(record, "CELLS") == "SURFACE") call add_error(errors, record%origin, &
          "CELLS=SURFACE with a blank of solid elements", "CELLS=LAGRANGE, or ELEMENT=SHELL "// &
          "of *BLANK")
        if (is_among("RESULTANTS", list_entries(option_text(record, "FIELDS")))) &
          call add_error(errors, record%origin, "FIELDS=RESULTANTS with a blank of solid "// &
          "elements", "FIELDS=STRESS, or ELEMENT=SHELL of *BLANK")
      end associate
    end do
  end subroutine check_shell_output

  !> Refuse masses scaled through the thickness.
  subroutine check_shell_masses(deck, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(scene_t), intent(in) :: scene
    type(error_list_t), intent(inout) :: errors
    integer, allocatable :: found(:)

    if (.not. (scene%blank%is_shell .and. scene%step%thickness_factor > 1)) return
    found = find_records(deck, "MASS SCALING")
    call add_error(errors, deck%records(found(1))%origin, "THICKNESS="// &
                   rounded_text(scene%step%thickness_factor)//" with ELEMENT=SHELL, which has "// &
                   "no motion through the thickness", "DT alone, no *MASS SCALING, or "// &
                   "ELEMENT=SOLID")
  end subroutine check_shell_masses

end module shell_check
