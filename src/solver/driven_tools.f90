!> Tools that forces move, in static increments: each adds the way along its force to the unknowns,
!! coupled with the control points by the contact springs alone. These ways are eliminated last, so
!! that the sparse matrix stays as it is: with [K B; B' C] [u; w] = [r; s],
!! w = (C - B' K^-1 B)^-1 (s - B' K^-1 r) and u = K^-1 r - K^-1 B w.
module driven_tools
  use kinds, only: wp
  use failure, only: error_t, fail
  use linear_algebra, only: solve
  use tool, only: tool_t
  use effect, only: effect_slot_t
  use tool_drive, only: drive_view_t, tool_drives, rest_drive
  use unknowns, only: unknowns_t
  use sparse_factor, only: sparse_factor_t
  implicit none
  private

  public :: driven_tools_t, new_driven_tools, begin_drives, rest_drives, set_tool_ways
  public :: begin_coupling, add_rest, add_spring, find_tool_residual, solve_coupled

  real(wp), parameter :: little = 1.0e-9_wp   !! of all springs of a tool, where none is loaded

  !> The driven tools that act.
  type :: driven_tools_t
    integer :: n = 0
    integer, allocatable :: tool(:)                !! of the model, shape (n)
    real(wp), allocatable :: direction(:, :)       !! of unit length, (3, n)
    real(wp), allocatable :: residual(:)           !! that the forces lack, (n) [force]
    real(wp), allocatable :: coupling(:, :)        !! B, (unknowns, n) [force/length]
    real(wp), allocatable :: own(:)                !! diagonal of C, (n) [force/length]
    real(wp) :: largest = 0.0_wp                   !! force of a drive [force]
  end type driven_tools_t

contains

  !> Those among the effects on velocities.
  subroutine new_driven_tools(self, supports)
    type(driven_tools_t), intent(out) :: self
    type(effect_slot_t), intent(in), target :: supports(:)
    type(drive_view_t), allocatable :: drives(:)
    integer :: i

    drives = tool_drives(supports)
    self%n = size(drives)
    allocate (self%tool(self%n), self%direction(3, self%n))
    allocate (self%residual(self%n), self%own(self%n), source=0.0_wp)
    do i = 1, self%n
      self%tool(i) = drives(i)%drive%tool
      self%direction(:, i) = drives(i)%drive%direction
    end do
  end subroutine new_driven_tools

  !> A static step begins: what the drives lack is ramped down over it.
  subroutine begin_drives(supports, tools, time)
    type(effect_slot_t), intent(in), target :: supports(:)
    type(tool_t), intent(inout) :: tools(:)
    real(wp), intent(in) :: time
    type(drive_view_t), allocatable :: drives(:)
    integer :: i

    call rest_drives(supports, tools, time)
    drives = tool_drives(supports)
    do i = 1, size(drives)
      drives(i)%drive%released = -drives(i)%drive%net
    end do
  end subroutine begin_drives

  !> Bring all driven tools to rest.
  subroutine rest_drives(supports, tools, time)
    type(effect_slot_t), intent(in), target :: supports(:)
    type(tool_t), intent(inout) :: tools(:)
    real(wp), intent(in) :: time
    type(drive_view_t), allocatable :: drives(:)
    integer :: i

    drives = tool_drives(supports)
    do i = 1, size(drives)
      call rest_drive(drives(i)%drive, tools(drives(i)%drive%tool), time)
    end do
  end subroutine rest_drives

  !> Velocities of the tools in an increment.
  pure subroutine set_tool_ways(self, ways, dt, tools)
    type(driven_tools_t), intent(in) :: self
    real(wp), intent(in) :: ways(:)                !! along the forces [length]
    real(wp), intent(in) :: dt                     !! [time]
    type(tool_t), intent(inout) :: tools(:)
    integer :: i

    do i = 1, self%n
      tools(self%tool(i))%velocity = ways(i)/dt*self%direction(:, i)
    end do
  end subroutine set_tool_ways

  !> What forces of drives and sheet lack to equilibrium.
  subroutine find_tool_residual(self, supports, tools, time, level)
    type(driven_tools_t), intent(inout) :: self
    type(effect_slot_t), intent(in), target :: supports(:)
    type(tool_t), intent(in) :: tools(:)
    real(wp), intent(in) :: time, level            !! level: of what is ramped down, 1 to 0
    type(drive_view_t), allocatable :: drives(:)
    integer :: i

    drives = tool_drives(supports)
    self%largest = 0.0_wp
    do i = 1, self%n
      associate (drive => drives(i)%drive)
        self%residual(i) = drive%net_force(tools(drive%tool), time) + level*drive%released
        self%largest = max(self%largest, &
                           abs(dot_product(tools(drive%tool)%force, drive%direction)), &
                           abs(drive%released))
      end associate
    end do
  end subroutine find_tool_residual

  !> No springs yet.
  pure subroutine begin_coupling(self, n_unknowns)
    type(driven_tools_t), intent(inout) :: self
    integer, intent(in) :: n_unknowns

    if (allocated(self%coupling)) deallocate (self%coupling)
    allocate (self%coupling(n_unknowns, self%n), source=0.0_wp)
    self%own = 0.0_wp
  end subroutine begin_coupling

  !> A tool that touches nothing is held a little.
  pure subroutine add_rest(self, tool, stiffness)
    type(driven_tools_t), intent(inout) :: self
    integer, intent(in) :: tool
    real(wp), intent(in) :: stiffness              !! of all springs of a contact pair

    where (self%tool == tool) self%own = self%own + little*stiffness
  end subroutine add_rest

  !> Add the contact spring of a point.
  pure subroutine add_spring(self, tool, map, spring, way, components)
    type(driven_tools_t), intent(inout) :: self
    integer, intent(in) :: tool
    type(unknowns_t), intent(in) :: map
    real(wp), intent(in) :: spring(3, 3)           !! [force/length]
    real(wp), intent(in) :: way(:, :)              !! of the point with the components, (3, n)
    integer, intent(in) :: components(:)
    real(wp) :: force(3)
    integer :: i, k, t

    do t = 1, self%n
      if (self%tool(t) /= tool) cycle
      force = matmul(spring, self%direction(:, t))
      self%own(t) = self%own(t) + dot_product(force, self%direction(:, t))
      do i = 1, size(components)
        do k = map%first(components(i)), map%first(components(i) + 1) - 1
          associate (b => self%coupling(map%unknown(k), t))
            b = b - map%coefficient(k)*dot_product(way(:, i), force)
          end associate
        end do
      end do
    end do
  end subroutine add_spring

  !> Displacements of the unknowns and ways of the tools that balance all residuals.
  subroutine solve_coupled(self, factor, residual, u, ways, error)
    type(driven_tools_t), intent(in) :: self
    type(sparse_factor_t), intent(inout) :: factor
    real(wp), intent(in) :: residual(:)            !! of the unknowns, those of tools last [force]
    real(wp), allocatable, intent(out) :: u(:), ways(:)   !! [length]
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: columns(:, :)
    real(wp) :: matrix(self%n, self%n)
    logical :: is_solved
    integer :: i, n

    n = size(residual) - self%n
    columns = reshape([residual(:n), self%coupling], [n, self%n + 1])
    call factor%solve(columns, error)
    if (allocated(error)) return
    u = columns(:, 1)
    allocate (ways(self%n))
    if (self%n == 0) return
    matrix = -matmul(transpose(self%coupling), columns(:, 2:))
    do i = 1, self%n
      matrix(i, i) = matrix(i, i) + self%own(i)
    end do
    ways = residual(n + 1:) - matmul(transpose(self%coupling), u)
    call solve(matrix, ways, is_solved)
    if (.not. is_solved) then
      call fail(error, "the tools that forces move have no equilibrium")
      return
    end if
    u = u - matmul(columns(:, 2:), ways)
  end subroutine solve_coupled

end module driven_tools
