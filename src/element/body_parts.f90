!> A body of several parts: forces part by part, and what meets at seams summed up.
module body_parts
  use kinds, only: wp
  use text, only: to_text
  use state_store, only: state_store_t, carry_array
  use patch_seams, only: seams_t, collect, sum_groups, distribute
  use outline_ties, only: collect_forces, lead_points
  use block_law, only: block_law_t
  use element, only: part_t, force_report_t, merge_reports
  use shell_joints, only: shell_joints_t, add_joint_forces
  implicit none
  private

  public :: forces_of_parts, end_forces_of_parts, elastic_copies, set_inertia
  public :: share_internal_forces, share_external_forces, lead_edges, has_edges, carry_fields
  public :: vector_at

  !> A field on the control points or the integration points of one part.
  type, public :: field_t
    real(wp), allocatable :: values(:, :, :, :)
  end type field_t

contains

  !> Stress update and internal forces of all parts, from the motion that each holds.
  subroutine forces_of_parts(parts, seams, law, dt, report, is_trial, joints)
    type(part_t), intent(inout) :: parts(:)
    type(seams_t), intent(inout) :: seams
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt                      !! [time]
    type(force_report_t), intent(out) :: report     !! of all parts together
    logical, intent(in), optional :: is_trial       !! leaves stress and state as they are
    type(shell_joints_t), intent(inout), optional :: joints   !! of shells that pass moments
    type(force_report_t) :: part
    logical :: is_committed
    integer :: p

    is_committed = .true.
    if (present(is_trial)) is_committed = .not. is_trial
    do p = 1, size(parts)
      if (is_committed) then
        call parts(p)%element%forces(law, dt, part)
      else
        call parts(p)%element%trial_forces(law, dt, part)
      end if
      call add_part(p, part, report)
    end do
    if (present(joints)) call add_joint_forces(joints, parts, dt, .not. is_committed, report)
    call share_internal_forces(parts, seams)
  end subroutine forces_of_parts

  !> Add the report of a part to that of all parts.
  pure subroutine add_part(p, part, report)
    integer, intent(in) :: p
    type(force_report_t), intent(in) :: part
    type(force_report_t), intent(inout) :: report

    call merge_reports(report, part)
    if (report%failed_block == huge(1) .and. part%failed_block < huge(1)) then
      report%failed_block = part%failed_block
      report%failed_part = p
    end if
  end subroutine add_part

  !> Internal forces at the end of trial motions, each part its own: nothing is summed at seams.
  subroutine end_forces_of_parts(parts, law, dt, report, joints)
    type(part_t), intent(inout) :: parts(:)
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt                      !! [time]
    type(force_report_t), intent(out) :: report     !! of all parts together
    type(shell_joints_t), intent(inout) :: joints   !! of shells that pass moments
    type(force_report_t) :: part
    integer :: p

    do p = 1, size(parts)
      call parts(p)%element%end_forces(law, dt, part)
      call add_part(p, part, report)
    end do
    call add_joint_forces(joints, parts, dt, .true., report)
  end subroutine end_forces_of_parts

  !> Copies of parts for trial motions of an elastic law.
  function elastic_copies(parts) result(copies)
    type(part_t), intent(in) :: parts(:)
    type(part_t), allocatable :: copies(:)
    integer :: p

    allocate (copies(size(parts)))
    do p = 1, size(parts)
      call parts(p)%element%elastic_copy(copies(p)%element)
    end do
  end function elastic_copies

  !> Put fields of all parts, or take them back; those not there yet leave nothing. Others in the
  !! store, of another shape, are its error.
  subroutine carry_fields(store, name, fields)
    type(state_store_t), intent(inout) :: store
    character(*), intent(in) :: name
    type(field_t), allocatable, intent(inout) :: fields(:)
    integer :: p

    if (.not. allocated(fields)) return
    do p = 1, size(fields)
      call carry_array(store, name//"_"//to_text(p), size(fields(p)%values), fields(p)%values)
    end do
  end subroutine carry_fields

  !> Sum up the masses that meet at seams. To be called again after a change of masses.
  subroutine set_inertia(parts, seams)
    type(part_t), intent(inout) :: parts(:)
    type(seams_t), intent(inout) :: seams
    integer :: p

    do p = 1, size(parts)
      associate (element => parts(p)%element)
        element%inertia = element%mass
        call collect(seams, p, size(element%mass), 1, element%mass)
      end associate
    end do
    call sum_groups(seams, 1)
    do p = 1, size(parts)
      associate (element => parts(p)%element)
        call distribute(seams, p, size(element%mass), 1, element%inertia)
        ! What has no mass follows others or stays where it is: any inertia does.
        where (element%inertia <= 0.0_wp) element%inertia = maxval(element%mass)
      end associate
    end do
  end subroutine set_inertia

  !> Give control points at the edges of outlines the velocities of those that they follow.
  subroutine lead_edges(parts)
    type(part_t), intent(inout) :: parts(:)
    integer :: p

    do p = 1, size(parts)
      if (parts(p)%element%ties%n > 0) &
        call lead_points(parts(p)%element%ties, parts(p)%element%motion%v)
    end do
  end subroutine lead_edges

  !> Does any control point follow others so?
  pure logical function has_edges(parts)
    type(part_t), intent(in) :: parts(:)
    integer :: p

    has_edges = any([(parts(p)%element%ties%n > 0, p=1, size(parts))])
  end function has_edges

  !> Sum up the internal forces that meet at seams, and bring those at edges of outlines to what
  !! leads there.
  subroutine share_internal_forces(parts, seams)
    type(part_t), intent(inout) :: parts(:)
    type(seams_t), intent(inout) :: seams
    integer :: p

    do p = 1, size(parts)
      if (parts(p)%element%ties%n > 0) &
        call collect_forces(parts(p)%element%ties, parts(p)%element%motion%internal_force)
    end do
    if (seams%n_groups == 0) return
    do p = 1, size(parts)
      call collect(seams, p, size(parts(p)%element%mass), 3, parts(p)%element%motion%internal_force)
    end do
    call sum_groups(seams, 3)
    do p = 1, size(parts)
      call distribute(seams, p, size(parts(p)%element%mass), 3, &
                      parts(p)%element%motion%internal_force)
    end do
  end subroutine share_internal_forces

  !> The same of the forces from outside.
  subroutine share_external_forces(parts, seams)
    type(part_t), intent(inout) :: parts(:)
    type(seams_t), intent(inout) :: seams
    integer :: p

    do p = 1, size(parts)
      if (parts(p)%element%ties%n > 0) &
        call collect_forces(parts(p)%element%ties, parts(p)%element%motion%external_force)
    end do
    if (seams%n_groups == 0) return
    do p = 1, size(parts)
      call collect(seams, p, size(parts(p)%element%mass), 3, parts(p)%element%motion%external_force)
    end do
    call sum_groups(seams, 3)
    do p = 1, size(parts)
      call distribute(seams, p, size(parts(p)%element%mass), 3, &
                      parts(p)%element%motion%external_force)
    end do
  end subroutine share_external_forces

  !> Vector of a field at a control point, by its number in the grid, axis 1 fastest.
  pure function vector_at(values, point) result(vector)
    real(wp), intent(in) :: values(:, :, :, :)
    integer, intent(in) :: point
    real(wp) :: vector(3)
    integer :: n(4)

    n = shape(values)
    vector = values(mod(point - 1, n(1)) + 1, mod((point - 1)/n(1), n(2)) + 1, &
                    (point - 1)/(n(1)*n(2)) + 1, :)
  end function vector_at

end module body_parts
