!> What goes into a results file: what it is made from, and one frame.
module frame_data
  use kinds, only: wp
  use text, only: string_t
  use gauss_rule, only: gauss_rule_t
  use nurbs_solid, only: nurbs_solid_t
  use nurbs_surface, only: nurbs_surface_t
  use history, only: history_row_t
  use provenance, only: provenance_t
  use display_fields, only: patch_frame_t, tool_frame_t
  implicit none
  private

  public :: display_patch_t, display_tool_t, results_setup_t, frame_t, mesh_place_t

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
    integer :: n_contact_fields = 0                     !! 1: contact pressure, 2: and wear
    real(wp) :: blank_mass = 0.0_wp                     !! without what scaling has added
    real(wp) :: width_ratio = 1.0_wp                    !! full width over that of the blank
    type(provenance_t) :: provenance
  end type results_setup_t

  !> One frame.
  type :: frame_t
    real(wp) :: time = 0.0_wp
    integer :: process_step = 1                         !! step of the deck
    type(patch_frame_t), allocatable :: patches(:)
    real(wp), allocatable :: tool_displacement(:, :)    !! (3, tools)
    real(wp), allocatable :: tool_velocity(:, :)        !! (3, tools)
    real(wp), allocatable :: tool_turn(:, :, :)         !! rotation less one, (3, 3, tools); may be
    real(wp), allocatable :: tool_turn_rate(:, :, :)    !! missing, as this: [1/time]
    type(tool_frame_t), allocatable :: tool_fields(:)   !! may be missing
    logical :: is_failed = .false.                      !! the state at which a run failed
  end type frame_t

  !> Where the display points of a surface of a tool are.
  type :: mesh_place_t
    integer :: tool = 0, surface = 0, first = 0
    real(wp), allocatable :: xi(:), eta(:)
  end type mesh_place_t

end module frame_data
