!> Pressure and wear of a contact pair as fields, for decks that ask for them.
!!
!! On the blank the pressure of a secondary point is its normal force over its present area.
!! On the tool the normal forces of these points are shared out to the nodes of a grid on each
!! surface, whose cells are about as large as the elements of the blank, and divided by the nodes'
!! areas; so the integral of the pressure is the normal force. The wear indicator of J. F. Archard
!! (1953) is gathered in the same way: normal force times slip, summed over all steps, per area of
!! the tool. Times the tool's wear coefficient over its hardness it is a depth.
module contact_fields
  use kinds, only: wp
  use failure, only: error_t
  use text, only: to_text
  use state_store, only: state_store_t, carry_array, carry_flags
  use nurbs_surface, only: nurbs_surface_t
  use surface_grid, only: surface_grid_t, new_surface_grid, grid_areas, grid_position
  use tool, only: tool_t
  use tool_face, only: face_derivatives, unit_normal
  use secondary_surface, only: secondary_surface_t, new_secondary_surface, secondary_positions
  use contact, only: contact_t
  implicit none
  private

  public :: contact_fields_t, tool_field_t, new_contact_fields, add_wear, face_pressure
  public :: set_tool_pressure, carry_wear

  !> A field on one surface of a tool.
  type :: tool_field_t
    type(surface_grid_t) :: grid
    real(wp), allocatable :: areas(:, :)    !! of the nodes [area]
    real(wp), allocatable :: pressure(:, :) !! [stress]
    real(wp), allocatable :: wear(:, :)     !! [stress*length]; only if it is asked for
  end type tool_field_t

  !> What a contact pair keeps for its fields.
  type :: contact_fields_t
    integer :: kind = 0                     !! of the secondary points
    integer :: n_gauss(2) = 0
    integer :: face = 0                     !! of the patch
    type(nurbs_surface_t) :: surface        !! of the blank, without its control points
    type(tool_field_t), allocatable :: tools(:)   !! one for each surface of the tool
    logical :: has_wear = .false.
    logical, allocatable :: is_touching(:)  !! at the last call, shape (n_points)
    real(wp), allocatable :: stretch(:, :)  !! of the spring of friction then, shape (3, n_points)
  end type contact_fields_t

contains

  !> Grids on the tool; nothing is worn yet.
  subroutine new_contact_fields(fields, pair, tool, surface, face, kind, n_gauss, length, has_wear)
    type(contact_fields_t), intent(out) :: fields
    type(contact_t), intent(in) :: pair
    type(tool_t), intent(in) :: tool
    type(nurbs_surface_t), intent(in) :: surface      !! the face of the blank
    integer, intent(in) :: face, kind, n_gauss(2)     !! as `new_secondary_surface` takes them
    real(wp), intent(in) :: length                    !! of an element of the blank [length]
    logical, intent(in) :: has_wear
    integer :: s

    fields%kind = kind
    fields%n_gauss = n_gauss
    fields%face = face
    fields%surface = surface
    deallocate (fields%surface%points)
    fields%has_wear = has_wear
    allocate (fields%tools(size(tool%surfaces)))
    do s = 1, size(fields%tools)
      associate (field => fields%tools(s))
        field%grid = new_surface_grid(tool%surfaces(s), length)
        field%areas = grid_areas(tool%surfaces(s), field%grid)
        if (tool%is_trimmed) call leave_inside(tool, s, field)
        allocate (field%pressure, mold=field%areas)
        field%pressure = 0.0_wp
        if (has_wear) allocate (field%wear, source=field%pressure)
      end associate
    end do
    if (.not. has_wear) return
    allocate (fields%is_touching(pair%secondary%n_points), source=.false.)
    if (allocated(pair%friction)) allocate (fields%stretch, source=pair%friction%stretch)
  end subroutine new_contact_fields

  !> The areas of what a trim leaves. Nodes with next to nothing get nothing, for the force of a
  !! single point on it would be a pressure beyond all others.
  subroutine leave_inside(tool, s, field)
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: s                          !! the surface
    type(tool_field_t), intent(inout) :: field
    real(wp), parameter :: least = 0.05_wp            ! of the whole area
    real(wp) :: inside(size(field%areas, 1), size(field%areas, 2))

    inside = grid_areas(tool%surfaces(s), field%grid, tool%trims(s))
    field%areas = merge(inside, 0.0_wp, inside >= least*field%areas)
  end subroutine leave_inside

  !> Add the wear of the step that led to the present forces: the mean of the normal force is that
  !! of its end, the slip is the motion along the tool but for what the spring of friction took up.
  subroutine add_wear(fields, pair, tool)
    type(contact_fields_t), intent(inout) :: fields
    type(contact_t), intent(in) :: pair
    type(tool_t), intent(in) :: tool
    real(wp) :: moved(pair%secondary%n_points, 3), slip(3), normal(3), pushed
    integer :: p

    if (pair%statistics%n_touching == 0) then
      fields%is_touching = .false.
      return
    end if
    ! Positions are linear in the control points, so motions follow from those of these.
    call secondary_positions(pair%secondary, pair%motion%now - pair%motion%before, moved)
    do p = 1, pair%secondary%n_points
      call push_of(pair, tool, p, pushed, normal)
      if (pushed > 0.0_wp) then
        if (fields%is_touching(p)) then
          slip = moved(p, :) - pair%motion%moved   ! against the tool, in its frame
          slip = slip - dot_product(slip, normal)*normal
          if (allocated(pair%friction)) &
            slip = slip - (pair%friction%stretch(:, p) - fields%stretch(:, p))
          associate (field => fields%tools(tool%surface_of(pair%face(p))))
            call share_out(field%grid, place_on(pair, tool, p), pushed*norm2(slip), field%areas, &
                           field%wear)
          end associate
        end if
        if (allocated(pair%friction)) fields%stretch(:, p) = pair%friction%stretch(:, p)
      end if
      fields%is_touching(p) = pushed > 0.0_wp
    end do
  end subroutine add_wear

  !> Normal force of a secondary point now, 0 where it does not touch, and the normal of the tool.
  pure subroutine push_of(pair, tool, point, pushed, normal)
    type(contact_t), intent(in) :: pair
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: point
    real(wp), intent(out) :: pushed, normal(3)
    real(wp) :: at(3), d1(3, 2), d2(3, 3)

    pushed = 0.0_wp
    normal = 0.0_wp
    if (all(abs(pair%force(point, :)) <= 0.0_wp)) return
    call face_derivatives(tool%coefficients, pair%face(point), pair%at(:, point), at, d1, d2)
    normal = unit_normal(d1)
    pushed = abs(dot_product(pair%force(point, :), normal))
  end subroutine push_of

  !> Parameters of the place where a secondary point touches.
  pure function place_on(pair, tool, point) result(at)
    type(contact_t), intent(in) :: pair
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: point
    real(wp) :: at(2)

    associate (low => tool%low(:, pair%face(point)), high => tool%high(:, pair%face(point)))
      at = low + pair%at(:, point)*(high - low)
    end associate
  end function place_on

  !> Add an amount at a place to a field per area, so that its integral grows by that amount. Nodes
  !! without area, at a collapsed edge, leave theirs to the others of the cell.
  pure subroutine share_out(grid, at, amount, areas, field)
    type(surface_grid_t), intent(in) :: grid
    real(wp), intent(in) :: at(2), amount, areas(:, :)
    real(wp), intent(inout) :: field(:, :)
    integer :: cell(2), i, j
    real(wp) :: share(2), weights(2, 2)

    call grid_position(grid, at, cell, share)
    do j = 1, 2
      do i = 1, 2
        weights(i, j) = merge(share(1), 1 - share(1), i == 2)*merge(share(2), 1 - share(2), j == 2)
      end do
    end do
    associate (own => areas(cell(1):cell(1) + 1, cell(2):cell(2) + 1))
      where (own <= 1.0e-12_wp*maxval(own)) weights = 0.0_wp
      if (sum(weights) <= 0.0_wp) return
      weights = weights*(amount/sum(weights))
      where (weights > 0.0_wp)
        field(cell(1):cell(1) + 1, cell(2):cell(2) + 1) = &
          field(cell(1):cell(1) + 1, cell(2):cell(2) + 1) + weights/own
      end where
    end associate
  end subroutine share_out

  !> Pressure at the secondary points now, on their grid of parameters.
  subroutine face_pressure(fields, pair, tool, net_x, grid, pressure)
    type(contact_fields_t), intent(in) :: fields
    type(contact_t), intent(in) :: pair
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: net_x(pair%secondary%n_net(1), pair%secondary%n_net(2), 3)
      !! control points now [length]
    type(surface_grid_t), intent(out) :: grid             !! places of the secondary points
    real(wp), allocatable, intent(out) :: pressure(:, :)  !! [stress]
    type(nurbs_surface_t) :: surface
    type(secondary_surface_t) :: now
    type(error_t), allocatable :: error
    real(wp) :: normal(3), pushed
    integer :: p

    surface = fields%surface
    surface%points = net_x
    call new_secondary_surface(now, surface, fields%kind, fields%n_gauss, error)
    if (allocated(pair%secondary%whole_area)) &
      now%area = now%area*pair%secondary%area/pair%secondary%whole_area
    associate (n => pair%secondary%n_along)
      grid%xi = pair%secondary%lines(1)%xi
      grid%eta = pair%secondary%lines(2)%xi
      allocate (pressure(n(1), n(2)), source=0.0_wp)
      do p = 1, product(n)
        call push_of(pair, tool, p, pushed, normal)
        if (pushed <= 0.0_wp .or. now%area(p) <= 0.0_wp) cycle
        pressure(mod(p - 1, n(1)) + 1, (p - 1)/n(1) + 1) = pushed/now%area(p)
      end do
    end associate
  end subroutine face_pressure

  !> Set the pressure of this pair on the grids of its tool.
  pure subroutine set_tool_pressure(fields, pair, tool)
    type(contact_fields_t), intent(inout) :: fields
    type(contact_t), intent(in) :: pair
    type(tool_t), intent(in) :: tool
    real(wp) :: normal(3), pushed
    integer :: p, s

    do s = 1, size(fields%tools)
      fields%tools(s)%pressure = 0.0_wp
    end do
    do p = 1, pair%secondary%n_points
      call push_of(pair, tool, p, pushed, normal)
      if (pushed <= 0.0_wp) cycle
      associate (field => fields%tools(tool%surface_of(pair%face(p))))
        call share_out(field%grid, place_on(pair, tool, p), pushed, field%areas, field%pressure)
      end associate
    end do
  end subroutine set_tool_pressure

  !> State of the wear for checkpoints.
  pure subroutine carry_wear(fields, store)
    type(contact_fields_t), intent(inout) :: fields
    type(state_store_t), intent(inout) :: store
    integer :: s

    if (.not. fields%has_wear) return
    call carry_flags(store, "wear_touching", size(fields%is_touching), fields%is_touching)
    if (allocated(fields%stretch)) &
      call carry_array(store, "wear_stretch", size(fields%stretch), fields%stretch)
    do s = 1, size(fields%tools)
      call carry_array(store, "wear_"//to_text(s), size(fields%tools(s)%wear), fields%tools(s)%wear)
    end do
  end subroutine carry_wear

end module contact_fields
