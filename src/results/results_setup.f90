!> What a results file is made from.
module results_setup
  use kinds, only: wp
  use text, only: string_t
  use gauss_rule, only: gauss_rule_t
  use nurbs_solid, only: nurbs_solid_t
  use nurbs_surface, only: nurbs_surface_t
  use history, only: history_row_t
  use provenance, only: provenance_t
  use display_fields, only: field_entry_t, frame_t
  implicit none
  private

  public :: display_patch_t, display_tool_t, results_setup_t, frame_t

  !> A patch of the blank to be shown.
  type :: display_patch_t
    character(:), allocatable :: name
    type(nurbs_solid_t) :: solid                        !! at the start
    type(gauss_rule_t) :: rule(3)                       !! integration points of an element
  end type display_patch_t

  !> A tool to be shown.
  type :: display_tool_t
    character(:), allocatable :: name
    real(wp) :: cell_length = huge(1.0_wp)              !! of a Lagrange cell at most [length]
    type(nurbs_surface_t), allocatable :: surfaces(:)   !! in their place at the start
  end type display_tool_t

  !> What a results file is made from.
  type :: results_setup_t
    character(:), allocatable :: path
    type(display_patch_t), allocatable :: patches(:)    !! of the blank
    type(display_tool_t), allocatable :: tools(:)
    type(history_row_t) :: history                      !! a row filled once, for its columns
    type(string_t), allocatable :: steps(:)             !! of the deck, names; may be none
    integer :: n_state = 0                              !! columns of the frames' state
    type(string_t), allocatable :: state_names(:)       !! of these columns; may be none
    logical :: is_bezier = .false.                      !! Bezier cells instead of Lagrange
    type(field_entry_t), allocatable :: fields(:)       !! missing: `output_fields(0)`
    real(wp) :: blank_mass = 0.0_wp                     !! without what scaling has added
    real(wp) :: width_ratio = 1.0_wp                    !! full width over that of the blank
    type(provenance_t) :: provenance
  end type results_setup_t

end module results_setup
