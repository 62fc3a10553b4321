!> One patch of the blank as the kernels see it: tables, tiles, weights and point state.
module ig_patch
  use kinds, only: wp
  use basis_tables, only: axis_table_t, lane_table_t
  implicit none
  private

  public :: element_of_lane, lane_of_element

  !> Bulk viscosity, linear and quadratic; the lengths are those of the elements at the start, all
  !! of them only where it is active.
  type, public :: viscosity_t
    logical :: is_active = .false.
    real(wp) :: linear = 0.0_wp, quadratic = 0.0_wp
    real(wp) :: density = 0.0_wp, wave_speed = 0.0_wp
    real(wp) :: shortest = 0.0_wp               !! length
    real(wp), allocatable :: length(:, :)       !! shape (8, n_blocks)
  contains
    procedure :: damping_ratio
  end type viscosity_t

  !> A fixed share of the blocks: ranges of blocks along axis 1 and of elements along axis 2,
  !! all of axis 3; and the control points they touch. The same whatever the thread count.
  type, public :: tile_t
    integer :: block_first = 1, block_last = 0
    integer :: row_first = 1, row_last = 0
    integer :: control_first(2) = 1, control_last(2) = 0
    !> Rows of control points from the first to this one take the forces of the tile at once.
    integer :: own_last = 0
  end type tile_t

  !> Internal forces of one tile on the other control points it touches, before tiles are added up.
  type, public :: tile_buffer_t
    real(wp), allocatable :: force(:, :, :, :)
  end type tile_buffer_t

  !> Tables and state of a patch. Blocks are numbered along axis 1 first, then axis 2, axis 3.
  type, public :: ig_patch_t
    integer :: n_control(3) = 0
    integer :: n_blocks = 0
    integer :: kernel = 0                          !! instance, see kernel_dispatch
    type(axis_table_t) :: axes(3)
    type(lane_table_t) :: lanes
    logical :: is_rational = .false.
    real(wp), allocatable :: weights(:, :, :)      !! of the control points; rational only
    !> 1/W^3, dW/W (3) and W^2 at the points, (8, q3, 5, q1*q2, n_blocks); rational only.
    real(wp), allocatable :: rational(:, :, :, :, :)
    real(wp), allocatable :: stress(:, :, :, :, :) !! (8, q3, 6, q1*q2, n_blocks)
    real(wp), allocatable :: state(:, :, :, :, :)  !! (8, q3, n_state, q1*q2, n_blocks)
    !> Viscous stress of the last step, (8, q3, q1*q2, n_blocks); without viscosity one idle block.
    real(wp), allocatable :: push(:, :, :, :)
    !> Inverse of the jacobian at the start, row by row, (8, q3, 9, q1*q2, n_blocks); only for laws
    !! that need the context of their points, as are time and increment.
    real(wp), allocatable :: reference(:, :, :, :, :)
    !> Cube roots of the volumes of the elements at the start, (8, n_blocks); for the same laws.
    real(wp), allocatable :: element_size(:, :)
    real(wp) :: time = 0.0_wp                      !! of the last force evaluation
    integer :: increment = 0                       !! force evaluations so far
    integer :: step = 1                            !! of the deck, under way
    real(wp) :: step_start = 0.0_wp                !! time at which it began
    integer :: before_step = 0                     !! force evaluations before it
    integer :: n_fields = 0                        !! temperature and field variables of the deck
    !> The values at the control points that the points have at the end of the step, where that is
    !! known, and whether they had them at its start as well.
    real(wp), allocatable :: spread_values(:, :, :, :)
    logical :: is_spread = .false., is_settled = .false.
    !> At the points, at the start and then at the end of the step, (8, q3, 2*n_fields, q1*q2,
    !! n_blocks); only for laws that need the context of their points.
    real(wp), allocatable :: given(:, :, :, :, :)
    integer :: n_before = 0                        !! elements of the patches before, in numbers
    type(viscosity_t) :: viscosity
    type(tile_t), allocatable :: tiles(:)
  end type ig_patch_t

contains

  !> Element (e1, e2, e3) of a lane of a block.
  pure function element_of_lane(patch, block, lane) result(element)
    type(ig_patch_t), intent(in) :: patch
    integer, intent(in) :: block, lane
    integer :: element(3), b

    b = mod(block - 1, patch%lanes%n_blocks) + 1
    element(1) = patch%lanes%element(lane, b)
    element(2) = mod((block - 1)/patch%lanes%n_blocks, patch%axes(2)%n_elements) + 1
    element(3) = (block - 1)/(patch%lanes%n_blocks*patch%axes(2)%n_elements) + 1
  end function element_of_lane

  !> Block and lane that count for an element.
  pure function lane_of_element(patch, element) result(at)
    type(ig_patch_t), intent(in) :: patch
    integer, intent(in) :: element(3)
    integer :: at(2), b

    b = (element(1) - 1)/size(patch%lanes%element, 1) + 1
    at(1) = b + patch%lanes%n_blocks*((element(2) - 1) + patch%axes(2)%n_elements*(element(3) - 1))
    at(2) = findloc(patch%lanes%element(:, b) == element(1) .and. patch%lanes%is_owner(:, b), &
                    .true., dim=1)
  end function lane_of_element

  !> Largest damping ratio of the linear viscosity, from the largest frequency and that of the bulk
  !! part of the stiffness alone.
  pure real(wp) function damping_ratio(viscosity, bulk, omega, omega_bulk)
    class(viscosity_t), intent(in) :: viscosity
    real(wp), intent(in) :: bulk                  !! modulus [stress]
    real(wp), intent(in) :: omega, omega_bulk     !! angular frequencies [1/time]
    real(wp) :: lag

    damping_ratio = 0.0_wp
    if (.not. viscosity%is_active) return
    lag = viscosity%linear*viscosity%density*viscosity%wave_speed*maxval(viscosity%length)/bulk
    damping_ratio = 0.5_wp*lag*omega_bulk**2/omega
  end function damping_ratio

end module ig_patch
